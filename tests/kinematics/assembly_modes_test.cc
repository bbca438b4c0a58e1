#include "kinematics/assembly_modes.h"

#include <gmock/gmock.h>

#include <random>

#include "kinematics/forward.h"
#include "kinematics/geometry/covariance.h"
#include "kinematics/screw.h"
#include "tests/kinematics/dietmaier.h"
#include "tests/support/hexapods.h"
#include "tests/support/rigid_matchers.h"

namespace hexcal {
namespace {

double distance(const Rigid3& a, const Rigid3& b) {
  return (a.translation - b.translation).norm() + rotation_distance(a.rotation, b.rotation);
}

// The data's legs agree to 6.4e-10; a near-singular posture is known no better than that over its sigma.
double tolerance(double sigma_min) { return 1e-7 + 2e-9 / sigma_min; }

TEST(AssemblyModes, FindsDietmaiersFortyAndNothingElse) {
  const std::optional<Dietmaier> data = read_dietmaier();
  if (!data) GTEST_SKIP() << "without Dietmaier's postures";
  const AssemblyModes found = assembly_modes(data->geometry, data->lengths);
  EXPECT_TRUE(found.complete());
  ASSERT_EQ(found.modes.size(), 40u);
  std::vector<bool> used(40, false);
  for (std::size_t k = 0; k < data->postures.size(); ++k) {
    std::size_t nearest = 0;
    for (std::size_t n = 1; n < 40; ++n) {
      if (distance(found.modes[n].B_from_P, data->postures[k]) <
          distance(found.modes[nearest].B_from_P, data->postures[k]))
        nearest = n;
    }
    EXPECT_FALSE(used[nearest]);
    used[nearest] = true;
    EXPECT_LE(distance(found.modes[nearest].B_from_P, data->postures[k]), tolerance(data->sigma_min[k]))
        << "posture " << k + 1;
  }
}

TEST(AssemblyModes, ListTheFeasiblePoseFirstAndItsMirrorImage) {
  const PlatformGeometry g = surrogate_hexapod();
  const Rigid3 pose = g.B_from_P({{20, -10, 15}, {0.1, -0.05, 0.1}});
  const AssemblyModes found = assembly_modes(g, leg_lengths(g, pose));
  EXPECT_TRUE(found.complete());
  ASSERT_GE(found.modes.size(), 2u);
  EXPECT_THAT(found.modes[0].B_from_P, RigidNear(pose, 1e-9, 1e-9));
  EXPECT_EQ(found.modes[0].verdict, PoseVerdict::reachable);
  // Base and platform are planar, so the pose seen in the base plane's mirror is another.
  const Eigen::Vector3d mirrored = pose.translation.cwiseProduct(Eigen::Vector3d(1, 1, -1));
  const auto is_mirror = [&](const AssemblyMode& m) {
    return (m.B_from_P.translation - mirrored).norm() < 1e-9;
  };
  EXPECT_EQ(std::count_if(found.modes.begin(), found.modes.end(), is_mirror), 1);
  for (std::size_t n = 1; n < found.modes.size(); ++n) EXPECT_LE(found.modes[n].residual_mm, 1e-9);
}

TEST(AssemblyModes, SaysWhenThereIsNone) {
  PlatformGeometry g = surrogate_hexapod();
  const LegVector home_mm = leg_lengths(g, g.home_B_from_P());
  LegVector lengths = home_mm;
  lengths[0] = 5000;
  EXPECT_TRUE(assembly_modes(g, lengths).modes.empty());
  lengths[0] = -1;
  EXPECT_FALSE(assembly_modes(g, lengths).complete());
  EXPECT_THAT(assembly_modes(g, lengths).reason, testing::HasSubstr("not positive numbers"));
  g.screw = screw_with_tangential_axes(g, 5);
  const AssemblyModes screwed = assembly_modes(g, home_mm);
  EXPECT_EQ(screwed.reason, "a machine with a screw lead is not handled");
  EXPECT_FALSE(screwed.complete());
  EXPECT_TRUE(screwed.modes.empty());
}

TEST(Forward, ReturnsToEachOfDietmaiersPostures) {
  const std::optional<Dietmaier> data = read_dietmaier();
  if (!data) GTEST_SKIP() << "without Dietmaier's postures";
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> u(-1, 1);
  for (std::size_t k = 0; k < data->postures.size(); ++k) {
    Vector6d away;
    for (double& x : away) x = 1e-4 / std::sqrt(6.0) * u(random);
    const ForwardResult r =
        forward_kinematics(data->geometry, data->lengths, perturbed(data->postures[k], away));
    // Two postures with sigma_min below 1e-4 are nearer to each other than the perturbation.
    if (data->sigma_min[k] < 1e-3 && r.status != ForwardStatus::converged) continue;
    ASSERT_EQ(r.status, ForwardStatus::converged) << k + 1;
    if (data->sigma_min[k] >= 1e-3) {
      EXPECT_LE(distance(*r.B_from_P, data->postures[k]), tolerance(data->sigma_min[k])) << k + 1;
    }
  }
}

// Published numbers of the CDSL platform: R = Rz(-30 deg), t = (0, 0, -111.31).
TEST(Forward, ReproducesCdslsNumbers) {
  PlatformGeometry g;
  const std::array<double, 6> ax{59.14, 59.14, 37.98, -97.12, -97.12, 37.98};
  const std::array<double, 6> ay{78, -78, -90.22, -12.22, 12.22, 90.22};
  const std::array<double, 6> bx{83.14, 83.14, -38.97, -44.17, -44.17, -38.97};
  const std::array<double, 6> by{3, -3, -73.5, -70.5, 70.5, 73.5};
  for (std::size_t i = 0; i < 6; ++i) {
    g.base_joints_mm[i] = {ax[i], ay[i], 0};
    g.platform_joints_mm[i] = {bx[i], by[i], 0};
    g.actuators[i] = {0, 1, 50, 250};
  }
  const Rigid3 pose(quaternion_from_rpy({0, 0, -30 * kRadPerDeg}), {0, 0, -111.31});
  const LegVector published =
      (LegVector() << 162.107, 116.891, 162.106, 116.890, 162.104, 116.891).finished();
  EXPECT_THAT(leg_lengths(g, pose), MatrixNear(published, 1e-3));
  g.B_from_UG = Rigid3(quaternion_from_rpy({0, 0, 0}), {0, 0, -111.31});
  const ForwardResult r = forward_kinematics(g, leg_lengths(g, pose));
  ASSERT_EQ(r.status, ForwardStatus::converged) << r.reason;
  EXPECT_THAT(*r.B_from_P, RigidNear(pose, 1e-9, 1e-9));
}

// LinuxCNC's simulated hexapod (configs/sim/axis/vismach/hexapod-sim): home at z = 20 has six legs
// of 29.7466.
TEST(Forward, ReproducesLinuxCncsHome) {
  PlatformGeometry g;
  const std::array<double, 6> ax{-22.95, 22.95, 22.95, 0, 0, -22.95};
  const std::array<double, 6> ay{13.25, 13.25, 13.25, -26.5, -26.5, 13.25};
  const std::array<double, 6> bx{-1, 1, 10.459, 9.459, -9.459, -10.459};
  const std::array<double, 6> by{11.5, 11.5, -4.884, -6.616, -6.616, -4.884};
  for (std::size_t i = 0; i < 6; ++i) {
    g.base_joints_mm[i] = {ax[i], ay[i], 0};
    g.platform_joints_mm[i] = {bx[i], by[i], 0};
    g.actuators[i] = {0, 1, 10, 60};
  }
  g.B_from_UG = Rigid3::from_translation({0, 0, 20});
  ASSERT_EQ(geometry_fault(g), std::nullopt);
  EXPECT_THAT(leg_lengths(g, g.home_B_from_P()), MatrixNear(LegVector::Constant(29.7466).eval(), 5e-4));
  const ForwardResult r = forward_kinematics(g, LegVector::Constant(29.7466));
  ASSERT_EQ(r.status, ForwardStatus::converged) << r.reason;
  EXPECT_THAT(*r.B_from_P, RigidNear(g.home_B_from_P(), 1e-3, 1e-2));
}

}  // namespace
}  // namespace hexcal
