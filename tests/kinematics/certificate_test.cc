#include "kinematics/certificate.h"

#include <gmock/gmock.h>

#include <random>

#include "kinematics/forward.h"
#include "kinematics/interval.h"
#include "kinematics/screw.h"
#include "tests/kinematics/dietmaier.h"
#include "tests/support/hexapods.h"

namespace hexcal {
namespace {

TEST(Interval, EnclosesWhatLongDoubleFinds) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> u(-3, 3);
  for (int n = 0; n < 20000; ++n) {
    const double a = u(random);
    const double b = u(random) * std::exp(20 * u(random));
    const auto holds = [](const Interval& i, long double value) {
      return i.lower <= value && value <= i.upper;
    };
    EXPECT_TRUE(holds(Interval(a) + Interval(b), static_cast<long double>(a) + b));
    EXPECT_TRUE(holds(Interval(a) - Interval(b), static_cast<long double>(a) - b));
    EXPECT_TRUE(holds(Interval(a) * Interval(b), static_cast<long double>(a) * b));
    EXPECT_TRUE(holds(Interval(a) / Interval(b), static_cast<long double>(a) / b));
    EXPECT_TRUE(holds(a * Interval(b), static_cast<long double>(a) * b));
    EXPECT_TRUE(holds(square(Interval(a)), static_cast<long double>(a) * a));
    EXPECT_TRUE(holds(cosine(a), std::cos(static_cast<long double>(a))));
    EXPECT_TRUE(holds(sine(a), std::sin(static_cast<long double>(a))));
  }
}

TEST(Interval, FindsTheExtremesOfTheCosine) {
  EXPECT_EQ(cosine({-0.1, 0.2}).upper, 1);
  EXPECT_EQ(cosine({3, 3.3}).lower, -1);
  EXPECT_EQ(sine({1.5, 1.6}).upper, 1);
  EXPECT_EQ(square({-2, 1}).lower, 0);
  EXPECT_GT(cosine({0.5, 1}).lower, 0.54);
}

TEST(Certificate, ProvesThePoseUniqueInTheWorkspace) {
  const PlatformGeometry g = nategh_agheli_hexapod();
  SampleOptions options;
  options.count = 4;
  options.box = default_certificate_box();
  for (const Pose& pose : sample_poses(g, options).poses) {
    const Certificate c = certify(g, leg_lengths(g, g.B_from_P(pose)), pose, default_certificate_box());
    EXPECT_EQ(c.status, CertificateStatus::unique) << c.reason;
    ASSERT_EQ(c.poses.size(), 1u);
    EXPECT_LE(pose_error(c.poses[0], pose).norm(), 1e-9);
  }
}

TEST(Certificate, SaysWhenTheBoxHoldsNoneOrAnother) {
  const PlatformGeometry g = nategh_agheli_hexapod();
  const Pose pose{{20, -10, 30}, {0.1, 0.05, -0.1}};
  const LegVector lengths = leg_lengths(g, g.B_from_P(pose));
  PoseBox elsewhere;
  elsewhere.lower << 40, 40, 40, 0, 0, 0;
  elsewhere.upper << 60, 60, 60, 0.1, 0.1, 0.1;
  EXPECT_EQ(certify(g, lengths, pose, elsewhere).status, CertificateStatus::none);
  // A pose with other legs is not confirmed.
  const Certificate c = certify(g, lengths, Pose{}, default_certificate_box());
  EXPECT_EQ(c.status, CertificateStatus::undecided);
  EXPECT_THAT(c.reason, testing::HasSubstr("not the given one"));
}

TEST(Certificate, RefusesWhatItCannotProve) {
  PlatformGeometry g = nategh_agheli_hexapod();
  const LegVector lengths = leg_lengths(g, g.home_B_from_P());
  const auto expect_undecided = [&](const LegVector& legs, const PoseBox& box, const std::string& words,
                                    const CertificateOptions& options = {}) {
    const Certificate c = certify(g, legs, {}, box, options);
    EXPECT_EQ(c.status, CertificateStatus::undecided) << words;
    EXPECT_THAT(c.reason, testing::HasSubstr(words));
  };
  PoseBox box = default_certificate_box();
  box.upper[4] = 100 * kRadPerDeg;
  expect_undecided(lengths, box, "angles beyond +-180 deg");
  expect_undecided(lengths, default_certificate_box(), "the search ran out of boxes", {.largest_boxes = 1});
  LegVector bad = lengths;
  bad[0] = std::numeric_limits<double>::quiet_NaN();
  expect_undecided(bad, default_certificate_box(), "not finite");
  g.screw = screw_with_tangential_axes(g, 5);
  expect_undecided(lengths, default_certificate_box(), "screw lead");
}

// At Fichter's singularity two poses fall together: no box around them holds exactly one.
TEST(Certificate, ASingularPoseStaysUndecided) {
  const PlatformGeometry g = surrogate_hexapod();
  const Pose singular{{0, 0, 0}, {0, 0, 90 * kRadPerDeg}};
  PoseBox box;
  box.upper = Vector6d::Constant(1e-4);
  box.lower = -box.upper;
  box.lower[5] += singular.rpy_rad[2];
  box.upper[5] += singular.rpy_rad[2];
  const Certificate c =
      certify(g, leg_lengths(g, g.B_from_P(singular)), singular, box, {.smallest_mm = 1e-3});
  EXPECT_EQ(c.status, CertificateStatus::undecided);
  EXPECT_EQ(c.reason, "a pose in the box is too near a singularity");
}

// Around each of the 40 postures, boxes that hold others too.
TEST(Certificate, NeverClaimsUniquenessWhereDietmaierHasAnother) {
  const std::optional<Dietmaier> data = read_dietmaier();
  if (!data) GTEST_SKIP() << "without Dietmaier's postures";
  PlatformGeometry g = data->geometry;
  int unique = 0;
  for (std::size_t k = 0; k < data->postures.size(); ++k) {
    g.B_from_UG = data->postures[k];
    PoseBox box;
    box.upper << 0.2, 0.2, 0.2, 0.35, 0.35, 0.35;
    box.lower = -box.upper;
    int inside = 0;
    for (const Rigid3& posture : data->postures) {
      const Vector6d v = g.pose_from_B_from_P(posture).vector();
      inside += ((v - box.lower).minCoeff() >= 0 && (box.upper - v).minCoeff() >= 0) ? 1 : 0;
    }
    const ForwardResult polished = forward_kinematics(g, data->lengths, data->postures[k]);
    ASSERT_TRUE(polished.B_from_P);
    const Certificate c = certify(g, data->lengths, g.pose_from_B_from_P(*polished.B_from_P), box,
                                  {.largest_boxes = 8000, .smallest_mm = 1e-9});
    if (c.status == CertificateStatus::unique) {
      EXPECT_EQ(inside, 1) << "posture " << k + 1;
      ++unique;
    }
    EXPECT_NE(c.status, CertificateStatus::none);
  }
  EXPECT_GT(unique, 0);
}

}  // namespace
}  // namespace hexcal
