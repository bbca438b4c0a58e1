#include "kinematics/inverse.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <random>

#include "kinematics/geometry/input_error.h"
#include "tests/support/hexapods.h"
#include "tests/support/rigid_matchers.h"

namespace hexcal {
namespace {

using testing::HasSubstr;

InverseResult at(const PlatformGeometry& g, const Vector6d& pose) {
  return inverse_kinematics(g, g.B_from_P(Pose::from_vector(pose)));
}

Vector6d pose(double x, double y, double z, double roll_deg, double pitch_deg, double yaw_deg) {
  return (Vector6d() << x, y, z, roll_deg * kRadPerDeg, pitch_deg * kRadPerDeg, yaw_deg * kRadPerDeg)
      .finished();
}

TEST(Inverse, HomeIsReachable) {
  for (const PlatformGeometry& g : {surrogate_hexapod(), nategh_agheli_hexapod(), jugglebot_hexapod()}) {
    const InverseResult r = at(g, Vector6d::Zero());
    EXPECT_EQ(r.verdict, PoseVerdict::reachable) << reason(r);
    EXPECT_LE(r.base_angles_rad.maxCoeff(), 1e-12);
    EXPECT_LE(r.platform_angles_rad.maxCoeff(), 1e-12);
    EXPECT_LE(r.base_axis_angles_rad.cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_EQ(reason(r), "");
  }
}

TEST(Inverse, NamesTheLegAndByHowMuch) {
  const PlatformGeometry g = surrogate_hexapod();
  const InverseResult low = at(g, pose(0, 0, -200, 0, 0, 0));
  EXPECT_EQ(low.verdict, PoseVerdict::too_short);
  EXPECT_NEAR(-low.stroke_margin_mm, 380 - low.lengths_mm.minCoeff(), 1e-12);
  const InverseResult aside = at(g, pose(150, 20, 80, 0, 0, 0));
  EXPECT_EQ(aside.verdict, PoseVerdict::too_long);
  Eigen::Index longest = 0;
  aside.lengths_mm.maxCoeff(&longest);
  EXPECT_EQ(aside.leg, static_cast<int>(longest));
  EXPECT_THAT(reason(aside), HasSubstr("leg " + std::to_string(longest + 1)));
  EXPECT_THAT(reason(aside), HasSubstr("mm too long"));
}

TEST(Inverse, ReadingsFollowOffsetAndScale) {
  PlatformGeometry g = surrogate_hexapod();
  g.actuators[1].offset_mm = 400;
  g.actuators[1].mm_per_unit = -0.5;
  const InverseResult r = at(g, Vector6d::Zero());
  EXPECT_NEAR(r.readings[1], (r.lengths_mm[1] - 400) / -0.5, 1e-12);
  EXPECT_THAT(lengths_from_readings(g, r.readings), MatrixNear(r.lengths_mm, 1e-12));
}

TEST(Inverse, JointLimits) {
  PlatformGeometry g = surrogate_hexapod();
  g.joint_limits = JointLimits{10 * kRadPerDeg, 80 * kRadPerDeg};
  const InverseResult aside = at(g, pose(100, 0, 0, 0, 0, 0));
  EXPECT_EQ(aside.verdict, PoseVerdict::base_joint);
  EXPECT_EQ(reason(aside), fmt::format("base joint {} would turn {:.2f} deg", aside.leg + 1,
                                       aside.base_angles_rad.maxCoeff() * kDegPerRad));
  g.joint_limits = JointLimits{80 * kRadPerDeg, 10 * kRadPerDeg};
  const InverseResult tilted = at(g, pose(0, 0, 0, 15, 0, 0));
  EXPECT_EQ(tilted.verdict, PoseVerdict::platform_joint);
  EXPECT_THAT(reason(tilted), HasSubstr("platform joint"));
  // The cone allows it, an axis does not.
  g.joint_limits = JointLimits{80 * kRadPerDeg, 80 * kRadPerDeg, {{80 * kRadPerDeg, 3 * kRadPerDeg}}};
  EXPECT_EQ(at(g, pose(0, 0, 0, 0, 0, 30)).verdict, PoseVerdict::base_joint);
}

TEST(Inverse, TheBaseAxesMakeTheCone) {
  const PlatformGeometry g = surrogate_hexapod();
  const InverseResult r = at(g, pose(30, -20, 10, 3, 4, 12));
  for (Eigen::Index i = 0; i < 6; ++i) {
    const double first = r.base_axis_angles_rad(i, 0);
    const double second = r.base_axis_angles_rad(i, 1);
    EXPECT_NEAR(std::cos(r.base_angles_rad[i]), std::cos(first) * std::cos(second), 1e-12);
  }
}

TEST(Inverse, LegsThatCross) {
  PlatformGeometry g = surrogate_hexapod();
  for (Actuator& a : g.actuators) a = {0, 1, 100, 2000};
  g.joint_limits.reset();
  g.leg_radius_mm = 15;
  const InverseResult home = at(g, Vector6d::Zero());
  EXPECT_EQ(home.verdict, PoseVerdict::reachable) << reason(home);
  // The nearest two are 2 and 3 or the like: platform joints 150 mm from the middle and 24 deg apart.
  EXPECT_NEAR(home.clearance_mm, 2 * 150 * std::sin(12 * kRadPerDeg) - 30, 1e-9);
  const InverseResult turned = at(g, pose(0, 0, 0, 0, 0, 140));
  EXPECT_EQ(turned.verdict, PoseVerdict::legs_collide) << turned.clearance_mm;
  EXPECT_THAT(reason(turned), HasSubstr("overlap"));
}

TEST(Inverse, ANumberThatIsNoneIsNoPose) {
  const PlatformGeometry g = surrogate_hexapod();
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    const InverseResult r = at(g, pose(bad, 0, 0, 0, 0, 0));
    EXPECT_EQ(r.verdict, PoseVerdict::not_a_pose);
    EXPECT_EQ(reason(r), "the pose is not finite");
    EXPECT_EQ(at(g, pose(0, 0, 0, 0, bad, 0)).verdict, PoseVerdict::not_a_pose);
  }
}

// Fichter's singularity: a planar, symmetric machine turned by 90 deg about z.
TEST(Singularity, AQuarterTurnIsSingular) {
  PlatformGeometry g = surrogate_hexapod();
  for (Actuator& a : g.actuators) a = {0, 1, 100, 2000};
  g.joint_limits.reset();
  const InverseResult r = at(g, pose(0, 0, 0, 0, 0, 90));
  EXPECT_LE(r.singularity->sigma_min, 1e-12);
  EXPECT_EQ(at(g, pose(0, 0, 0, 0, 0, 89)).verdict, PoseVerdict::near_singular);
  const InverseResult beyond = at(g, pose(0, 0, 0, 0, 0, 91));
  EXPECT_EQ(beyond.verdict, PoseVerdict::beyond_singular);
  EXPECT_EQ(reason(beyond), "the pose lies beyond a singularity");
  EXPECT_THAT(reason(at(g, pose(0, 0, 0, 0, 0, 89))), HasSubstr("near a singularity"));
  // The distance is a distance: from 5 deg away, 5 deg.
  EXPECT_NEAR(at(g, pose(0, 0, 0, 0, 0, 85)).singularity->distance_deg, 5, 0.3);
}

TEST(Singularity, DoesNotDependOnFrameOrUnit) {
  PlatformGeometry g = surrogate_hexapod();
  const Rigid3 B_from_P = g.B_from_P(Pose::from_vector(pose(20, 30, -10, 5, -8, 20)));
  const SingularityMeasures here = singularity_measures(g, B_from_P);
  EXPECT_NEAR(here.characteristic_length_mm, 150, 1e-9);
  // Another origin of P: the same machine.
  PlatformGeometry moved = g;
  const Rigid3 P_from_Q = Rigid3::from_translation({40, -70, 200});
  for (Eigen::Vector3d& b : moved.platform_joints_mm) b = inverse(P_from_Q) * b;
  moved.P_from_LG = inverse(P_from_Q) * g.P_from_LG;
  const SingularityMeasures there = singularity_measures(moved, B_from_P * P_from_Q);
  EXPECT_NEAR(there.sigma_min, here.sigma_min, 1e-12);
  EXPECT_NEAR(there.distance_mm, here.distance_mm, 1e-8);
  EXPECT_NEAR(there.distance_deg, here.distance_deg, 1e-9);
  // Ten times the size: the same numbers without unit, ten times the mm.
  PlatformGeometry large = g;
  for (std::size_t i = 0; i < 6; ++i) {
    large.base_joints_mm[i] *= 10;
    large.platform_joints_mm[i] *= 10;
  }
  const Rigid3 far(B_from_P.rotation, 10 * B_from_P.translation);
  EXPECT_NEAR(singularity_measures(large, far).sigma_min, here.sigma_min, 1e-12);
  EXPECT_NEAR(singularity_measures(large, far).distance_mm, 10 * here.distance_mm, 1e-7);
}

TEST(Singularity, BoundsAreBelowTheMeasuresAndKeepTheVerdict) {
  std::mt19937_64 random(23);
  std::uniform_real_distribution<double> u(-1, 1);
  int clear = 0;
  for (PlatformGeometry g : {surrogate_hexapod(), nategh_agheli_hexapod(), jugglebot_hexapod()}) {
    for (Actuator& a : g.actuators) a = {0, 1, 1, 5000};
    g.joint_limits.reset();
    const RestState rest(g);
    for (int n = 0; n < 400; ++n) {
      Vector6d p;
      for (Eigen::Index k = 0; k < 6; ++k) p[k] = u(random) * (k < 3 ? 200 : 1.8);
      const Rigid3 B_from_P = g.B_from_P(Pose::from_vector(p));
      const SingularityMeasures m = singularity_measures(g, B_from_P);
      const SingularityBounds b = singularity_bounds(g, B_from_P, m.characteristic_length_mm);
      EXPECT_LE(b.sigma_min, m.sigma_min * (1 + 1e-9));
      EXPECT_LE(b.distance_mm, m.distance_mm * (1 + 1e-9));
      EXPECT_LE(b.distance_deg, m.distance_deg * (1 + 1e-9));
      EXPECT_NEAR(b.determinant, m.determinant, 1e-9);
      const InverseResult quick = inverse_kinematics(g, rest, B_from_P, {.measure_all = false});
      EXPECT_EQ(quick.verdict, inverse_kinematics(g, rest, B_from_P).verdict);
      clear += quick.singularity ? 0 : 1;
    }
  }
  EXPECT_GT(clear, 300);
}

TEST(Singularity, RefusesOptionsByName) {
  SingularityOptions options;
  options.near_gain = 0;
  try {
    options.validate();
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("near_gain"));
  }
}

}  // namespace
}  // namespace hexcal
