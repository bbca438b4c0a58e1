#include "kinematics/dh_chain.h"

#include <gmock/gmock.h>

#include <random>

#include "kinematics/geometry/covariance.h"
#include "tests/support/hexapods.h"
#include "tests/support/rigid_matchers.h"

namespace hexcal {
namespace {

Rigid3 random_pose(std::mt19937_64& random, const Rigid3& home, double mm, double rad) {
  std::uniform_real_distribution<double> u(-1, 1);
  Vector6d away;
  for (Eigen::Index k = 0; k < 6; ++k) away[k] = u(random) * (k < 3 ? mm : rad);
  return perturbed(home, away);
}

// T(i-1, i) = Rx(alpha) Tx(a) Rz(theta) Tz(d), multiplied out literally.
Rigid3 craig(double alpha_deg, double theta, double d) {
  const Eigen::Quaterniond rx(Eigen::AngleAxisd(alpha_deg * kRadPerDeg, Eigen::Vector3d::UnitX()));
  const Eigen::Quaterniond rz(Eigen::AngleAxisd(theta, Eigen::Vector3d::UnitZ()));
  return Rigid3::from_rotation(rx) * Rigid3::from_rotation(rz) * Rigid3::from_translation({0, 0, d});
}

TEST(DhChain, IsCraigsChain) {
  const Vector6d v = (Vector6d() << 0.3, 1.2, 480, -0.4, 1.7, 0.2).finished();
  const Rigid3 chain = craig(0, v[0], 0) * craig(-90, v[1], 0) * craig(90, 0, v[2]) * craig(0, v[3], 0) *
                       craig(-90, v[4], 0) * craig(90, v[5], 0);
  EXPECT_THAT(a_from_c(v), RigidNear(chain, 1e-12, 1e-12));
}

TEST(DhChain, EqualsTheClosedLoop) {
  std::mt19937_64 random(11);
  for (const PlatformGeometry& g : {surrogate_hexapod(), nategh_agheli_hexapod(), jugglebot_hexapod()}) {
    const std::array<LegChain, 6> chains = leg_chains(g);
    double worst_mm = 0;
    double worst_rad = 0;
    double worst_length_mm = 0;
    for (int n = 0; n < 20000 / 3 + 1; ++n) {
      const Rigid3 pose = random_pose(random, g.home_B_from_P(), 120, 0.5);
      const LegVector lengths = leg_lengths(g, pose);
      for (std::size_t i = 0; i < 6; ++i) {
        const Vector6d v = dh_variables(chains[i], pose);
        const Rigid3 back = pose_along_leg(chains[i], v);
        worst_mm = std::max(worst_mm, (back.translation - pose.translation).norm());
        worst_rad = std::max(worst_rad, rotation_distance(back.rotation, pose.rotation));
        worst_length_mm = std::max(worst_length_mm, std::abs(v[2] - lengths[static_cast<Eigen::Index>(i)]));
        ASSERT_NEAR(v[1], 1.5707963, 0.9);
        ASSERT_NEAR(v[4], 1.5707963, 1.2);
        ASSERT_LT(std::abs(v[3]), 2.6);
      }
    }
    EXPECT_LE(worst_mm, 1e-11);
    EXPECT_LE(worst_rad, 1e-11);
    EXPECT_LE(worst_length_mm, 1e-11);
  }
}

TEST(DhChain, HomeIsItsRest) {
  const PlatformGeometry g = surrogate_hexapod();
  const Matrix6d table = dh_table(leg_chains(g), g.home_B_from_P());
  EXPECT_LE(table.col(0).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LE(table.col(5).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LE((table.col(1).array() - 90 * kRadPerDeg).abs().maxCoeff(), 1e-12);
  EXPECT_LE((table.col(4).array() - 90 * kRadPerDeg).abs().maxCoeff(), 1e-12);
}

TEST(DhChain, StretchedAlongItsAxisStillClosesTheLoop) {
  const PlatformGeometry g = surrogate_hexapod();
  const LegChain chain = leg_chains(g)[0];
  // The leg along A's z axis, and C's z axis along the leg, forwards and backwards.
  for (const double theta2 : {0.0, 3.14159265358979323846}) {
    for (const double theta5 : {0.0, 3.14159265358979323846}) {
      const Rigid3 pose =
          pose_along_leg(chain, (Vector6d() << 0.4, theta2, 450, 0.3, theta5, 0.7).finished());
      EXPECT_THAT(pose_along_leg(chain, dh_variables(chain, pose)), RigidNear(pose, 1e-10, 1e-10));
    }
  }
}

TEST(DhChain, ErrorsAreWrapped) {
  const Vector6d a = (Vector6d() << 3.1, 1, 480, -3.1, 1, 0).finished();
  const Vector6d b = (Vector6d() << -3.1, 1, 470, 3.1, 1, 0).finished();
  const Vector6d error = dh_error(a, b);
  EXPECT_NEAR(error[0], 6.2 - 2 * 3.14159265358979323846, 1e-12);
  EXPECT_NEAR(error[3], -6.2 + 2 * 3.14159265358979323846, 1e-12);
  EXPECT_NEAR(error[2], 10, 1e-12);
}

TEST(Means, AreThoseOfTheSixLegs) {
  std::mt19937_64 random(3);
  const PlatformGeometry g = surrogate_hexapod();
  const Rigid3 pose = random_pose(random, g.home_B_from_P(), 30, 0.2);
  std::vector<Rigid3> all(6, pose);
  EXPECT_THAT(mean_motion(all), RigidNear(pose, 1e-12, 1e-10));
  // Opposite small perturbations leave the mean where it was, to second order.
  const Vector6d d = (Vector6d() << 1, -2, 3, 1e-5, 2e-5, -1e-5).finished();
  all = {perturbed(pose, d), perturbed(pose, -d)};
  EXPECT_THAT(mean_motion(all), RigidNear(pose, 1e-12, 1e-8));
}

TEST(Means, HalfTurnsDoNotFlipTheHand) {
  const std::vector<Rigid3> all{Rigid3::from_rotation(Eigen::Quaterniond(0, 1, 0, 0)),
                                Rigid3::from_rotation(Eigen::Quaterniond(0, 0, 1, 0)),
                                Rigid3::from_rotation(Eigen::Quaterniond(0, 0, 0, 1))};
  EXPECT_NEAR(mean_rotation(all).toRotationMatrix().determinant(), 1, 1e-12);
}

}  // namespace
}  // namespace hexcal
