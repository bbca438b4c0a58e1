#include "calibration/method_comparison.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>

#include "calibration/calibrate.h"
#include "tests/calibration/virtual_machine.h"
#include "tests/support/hexapods.h"

namespace hexcal {
namespace {

// Adds noise of its own to each pose and declares it.
void add_declared_noise(ObservationSet& set, const std::function<double(std::size_t)>& noise_mm,
                        unsigned seed) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < set.poses.size(); ++i) {
    Vector6d sigma;
    sigma << Eigen::Vector3d::Constant(noise_mm(i)), Eigen::Vector3d::Constant(noise_mm(i) / 150);
    Vector6d v = set.poses[i].measured.vector();
    for (Eigen::Index k = 0; k < 6; ++k) v[k] += sigma[k] * normal(rng);
    set.poses[i].measured = Pose::from_vector(v);
    set.poses[i].covariance = sigma.cwiseAbs2().asDiagonal();
  }
}

// Poses that were measured badly, and say so, accuse nobody and decide nothing: the method that the good ones
// prove is chosen.
TEST(MethodComparison, DeclaredNoiseIsNoFault) {
  const PlatformGeometry nominal = surrogate_hexapod();
  for (unsigned seed = 1; seed <= 2; ++seed) {
    const MachineModel truth = as_built(nominal, {0.3, 0.3, 0.001}, seed);
    ObservationSet set = measured(truth, nominal, random_poses(20, {}, 50 + seed), {});
    add_declared_noise(
        set, [](std::size_t i) { return i % 2 == 0 ? 0.01 : 2.0; }, seed);
    const CalibrationReport report = calibrate(nominal, set);
    EXPECT_TRUE(report.unexplained.empty()) << seed << ": " << report.unexplained.front();
    EXPECT_EQ(report.chosen.rfind("kinematic", 0), 0U) << seed << ": " << report.chosen;
  }
}

// Without noise, a pose beyond all others is predicted worse than they are, by any model.
TEST(MethodComparison, APoseBeyondAllOthersIsNotAccused) {
  const PlatformGeometry nominal = surrogate_hexapod();
  for (unsigned seed = 1; seed <= 2; ++seed) {
    const MachineModel truth = as_built(nominal, {1, 1, 0.005}, seed);
    std::vector<Pose> targets = random_poses(14, {10, 8, 3}, 60 + seed);
    targets.push_back(Pose::from_vector(
        (Vector6d() << 28, -25, 20, 9 * kRadPerDeg, -8 * kRadPerDeg, 10 * kRadPerDeg).finished()));
    ObservationSet set = measured(truth, nominal, targets, {0.001, 0.0004, seed});
    EXPECT_TRUE(calibrate(nominal, set).unexplained.empty()) << seed;
    // One that is wrong still is.
    set.poses[4].measured.position_mm.x() += 15;
    EXPECT_EQ(calibrate(nominal, set).unexplained, std::vector<std::string>{"p5"}) << seed;
  }
}

TEST(MethodComparison, RepeatsOfAPoseAreHeldOutTogether) {
  const PlatformGeometry nominal = surrogate_hexapod();
  const MachineModel truth = as_built(nominal, {1, 1, 0.005}, 3);
  std::vector<Pose> targets = random_poses(8, {}, 9);
  const std::vector<Pose> once = targets;
  for (int repeat = 0; repeat < 2; ++repeat) targets.insert(targets.end(), once.begin(), once.end());
  const ObservationSet set = measured(truth, nominal, targets, {0.01, 0.003, 5});
  const MethodComparison comparison = compare_methods(nominal, set, candidates_for(set, {}));
  EXPECT_TRUE(comparison.leave_one_out);
  EXPECT_EQ(comparison.folds, 8);
  const auto kinematic = std::ranges::find(comparison.methods, "kinematic", &CrossValidation::name);
  EXPECT_EQ(kinematic->poses, 24);
  // Each of the three predicts the others to the noise; of a pose that is not seen at all, eight say less.
  EXPECT_GT(kinematic->errors.position_rms_mm, 0.03);
}

}  // namespace
}  // namespace hexcal
