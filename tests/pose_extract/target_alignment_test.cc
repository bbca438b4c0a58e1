#include "pose_extract/target_alignment.h"

#include <gtest/gtest.h>

#include <random>

namespace hexcal {
namespace {

// Poses commanded in one frame and measured in another; `error` is what the machine does wrong.
std::vector<std::pair<Pose, Pose>> poses_in_two_frames(const Rigid3& measured_from_targets, double gd_mm,
                                                       int count, double error, bool one_axis = false) {
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::normal_distribution<double> normal(0, 1);
  std::vector<std::pair<Pose, Pose>> poses;
  for (int i = 0; i < count; ++i) {
    Pose target;
    target.position_mm = 20 * Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng));
    target.rpy_rad = 0.2 * Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng));
    if (one_axis) target.rpy_rad.head<2>().setZero();
    Pose reached = target;
    reached.position_mm += 5 * error * Eigen::Vector3d(normal(rng), normal(rng), normal(rng));
    reached.rpy_rad += 0.02 * error * Eigen::Vector3d(normal(rng), normal(rng), normal(rng));
    const Rigid3 motion = ug_from_lg(reached, gd_mm) * inverse(ug_from_lg(Pose{}, gd_mm));
    const Rigid3 seen = measured_from_targets * motion * inverse(measured_from_targets);
    poses.emplace_back(target, pose_from_ug_from_lg(seen * ug_from_lg(Pose{}, gd_mm), gd_mm));
  }
  return poses;
}

TEST(TargetAlignment, FindsTheFrameOfTheTargets) {
  const Rigid3 truth(quaternion_from_rpy({0.05, -0.1, 1.6}), {15, -8, 40});
  const auto exact = align_with_targets(poses_in_two_frames(truth, 50, 6, 0), Pose{}, 50);
  ASSERT_TRUE(exact);
  EXPECT_LT(rotation_distance(exact->measured_from_targets.rotation, truth.rotation), 1e-9);
  EXPECT_LT((exact->measured_from_targets.translation - truth.translation).norm(), 1e-6);
  EXPECT_LT(exact->rms_deg, 1e-6);
  // A machine with errors of 5 mm and 1 deg: the frame is found about as well as these average out.
  const auto rough = align_with_targets(poses_in_two_frames(truth, 50, 12, 1), Pose{}, 50);
  ASSERT_TRUE(rough);
  EXPECT_LT(rotation_distance(rough->measured_from_targets.rotation, truth.rotation), 5 * kRadPerDeg);
  EXPECT_GT(rough->rms_deg, 0.5);
}

TEST(TargetAlignment, RefusesWhatItCannotTell) {
  EXPECT_FALSE(align_with_targets(poses_in_two_frames({}, 50, 2, 0), Pose{}, 50));
  EXPECT_FALSE(align_with_targets(poses_in_two_frames({}, 50, 8, 0, true), Pose{}, 50));
}

}  // namespace
}  // namespace hexcal
