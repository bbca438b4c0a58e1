#include "calibration/paper_options.h"

#include <gtest/gtest.h>

#include "tests/calibration/virtual_machine.h"
#include "tests/support/hexapods.h"
#include "tests/support/rigid_matchers.h"

namespace hexcal {
namespace {

// Observations whose measured pose is a given function of the target.
template <class Function>
std::vector<PoseObservation> observed(const Function& actual_of) {
  std::vector<PoseObservation> poses;
  for (const Pose& target : random_poses(20, {}, 3)) {
    PoseObservation pose;
    pose.target = target;
    pose.measured = actual_of(target);
    poses.push_back(pose);
  }
  return poses;
}

TEST(PaperOptions, Option3UndoesALinePerParameter) {
  // actual = target + a + b target: the line is found, and target minus predicted error is what it says.
  const auto poses = observed([](const Pose& target) {
    Vector6d v = target.vector();
    for (Eigen::Index k = 0; k < 6; ++k) v[k] += 0.01 * static_cast<double>(k + 1) + 0.05 * v[k];
    return Pose::from_vector(v);
  });
  const PaperModel model = fit_paper_option(surrogate_hexapod(), 3, poses);
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_NEAR(model.pose_lines[k].intercept, 0.01 * static_cast<double>(k + 1), 1e-12);
    EXPECT_NEAR(model.pose_lines[k].slope, 0.05, 1e-12);
  }
  const Pose target{{10, -20, 5}, {0.1, 0, -0.1}};
  const Pose predicted = predicted_pose(surrogate_hexapod(), model, target);
  EXPECT_NEAR(predicted.position_mm.x(), 10 - 0.01 - 0.5, 1e-12);
  EXPECT_NEAR(predicted.rpy_rad.z(), -0.1 - 0.06 + 0.005, 1e-12);
}

TEST(PaperOptions, ConstantCurveTakesTheMean) {
  const auto poses = observed([](const Pose& target) {
    Pose actual = target;
    actual.position_mm.y() += 3;
    return actual;
  });
  const PaperModel model = fit_paper_option(surrogate_hexapod(), 3, poses, ErrorCurve::constant);
  EXPECT_NEAR(model.pose_lines[1].intercept, 3, 1e-12);
  EXPECT_EQ(model.pose_lines[1].slope, 0);
}

TEST(PaperOptions, WithoutErrorNothingChanges) {
  const PlatformGeometry nominal = surrogate_hexapod();
  const auto poses = observed([](const Pose& target) { return target; });
  const Pose target{{4, 6, -8}, {0.05, -0.1, 0.12}};
  for (int option = 1; option <= 3; ++option) {
    const PaperModel model = fit_paper_option(nominal, option, poses);
    EXPECT_THAT(predicted_pose(nominal, model, target).vector(), MatrixNear(target.vector(), 1e-9)) << option;
  }
}

TEST(PaperOptions, Option1LeavesTheOrientationAndOption2CorrectsIt) {
  const PlatformGeometry nominal = surrogate_hexapod();
  const ObservationSet set = measured(as_built(nominal, {}, 2), nominal, random_poses(34, {}, 4), {});
  const Pose target{{4, 6, -8}, {0.05, -0.1, 0.12}};
  const PaperModel one = fit_paper_option(nominal, 1, set.poses);
  const PaperModel two = fit_paper_option(nominal, 2, set.poses);
  const Pose by_one = predicted_pose(nominal, one, target);
  const Pose by_two = predicted_pose(nominal, two, target);
  EXPECT_EQ(by_one.rpy_rad, target.rpy_rad);
  EXPECT_NE(by_two.rpy_rad, target.rpy_rad);
  EXPECT_EQ(by_one.position_mm, by_two.position_mm);
  EXPECT_NE(by_one.position_mm, target.position_mm);
}

TEST(PaperOptions, NearSingularOutlierNeedsBothSigns) {
  const PlatformGeometry nominal = surrogate_hexapod();
  auto poses = observed([](const Pose& target) {
    Pose actual = target;
    actual.position_mm.x() += 1 + 0.01 * target.position_mm.y();
    return actual;
  });
  // Far out but well conditioned: stays.
  poses[4].measured.position_mm.x() += 30;
  EXPECT_TRUE(near_singular_outliers(nominal, poses).empty());
  // Turned about z towards the singular pose of this machine, and far out: goes.
  poses[7].target->rpy_rad = {0, 0, 75 * kRadPerDeg};
  poses[7].measured = *poses[7].target;
  poses[7].measured.position_mm.x() += 30;
  EXPECT_EQ(near_singular_outliers(nominal, poses), std::vector<std::size_t>{7});
}

}  // namespace
}  // namespace hexcal
