#include "tools/io/model_file.h"

#include <gtest/gtest.h>

#include "tests/support/error_matchers.h"
#include "tests/support/hexapods.h"
#include "tests/support/rigid_matchers.h"

namespace hexcal {
namespace {

const Pose kPose{{4, -7, 9}, {0.05, -0.03, 0.08}};

CalibrationModel kinematic_model() {
  CalibrationModel model{.method = CompensationMethod::kinematic, .nominal = surrogate_hexapod()};
  model.machine.geometry = surrogate_hexapod();
  model.machine.geometry.base_joints_mm[2] += Eigen::Vector3d(1.0 / 3, -2, 0.7);
  model.machine.geometry.actuators[4].mm_per_unit = 1.0123456789;
  for (StrokeCurve& curve : model.machine.stroke_curves) curve = {380, 580, {0.4, -0.2}};
  model.machine.sag << -0.2, 1.5, 0.3, 0.1;
  model.machine.backlash_mm << 0.05, 0, 0, 0, 0, 0;
  return model;
}

CalibrationModel paper_model(int option) {
  CalibrationModel model;
  model.method = option == 1   ? CompensationMethod::option1
                 : option == 2 ? CompensationMethod::option2
                               : CompensationMethod::option3;
  model.nominal = surrogate_hexapod();
  model.paper.option = option;
  for (std::size_t i = 0; i < 6; ++i) {
    model.paper.pose_lines[i] = {0.01 * static_cast<double>(i + 1) / 3, -0.05};
    for (std::size_t leg = 0; leg < 6 && option != 3; ++leg)
      model.paper.joint_lines[leg][i] = {0.002 * static_cast<double>(leg), 0.001 * static_cast<double>(i)};
  }
  return model;
}

TEST(ModelFile, RoundTripGivesTheSameReadings) {
  for (const CalibrationModel& model : {kinematic_model(), paper_model(1), paper_model(2), paper_model(3)}) {
    const CalibrationModel again = parse_model(model_text("# head\n", model), "model.yaml");
    EXPECT_EQ(model_text("", again), model_text("", model));
    EXPECT_THAT(*readings_for_pose(again, kPose), MatrixNear(*readings_for_pose(model, kPose), 1e-11));
  }
}

TEST(ModelFile, PoseAndReadingsAreInverse) {
  for (const CalibrationModel& model : {kinematic_model(), paper_model(1), paper_model(2), paper_model(3)}) {
    const auto readings = readings_for_pose(model, kPose);
    ASSERT_TRUE(readings);
    const auto pose = pose_for_readings(model, *readings);
    ASSERT_TRUE(pose) << name(model.method);
    EXPECT_THAT(pose->vector(), MatrixNear(kPose.vector(), 1e-9)) << name(model.method);
  }
}

TEST(ModelFile, RefusesWhatIsNoModel) {
  EXPECT_THAT([] { (void)parse_model("method: magic\n", "m.yaml"); }, ThrowsInputError("m.yaml:1: method"));
  const std::string text = model_text("", kinematic_model()) + "sagg: [1, 2, 3, 4]\n";
  EXPECT_THAT([&] { (void)parse_model(text, "m.yaml"); }, ThrowsInputError("did you mean 'sag'?"));
}

}  // namespace
}  // namespace hexcal
