#include "tools/io/controller_export.h"

#include <gtest/gtest.h>

#include "kinematics/inverse.h"
#include "kinematics/screw.h"
#include "tests/calibration/virtual_machine.h"
#include "tests/support/error_matchers.h"
#include "tests/support/hexapods.h"
#include "tests/support/rigid_matchers.h"

namespace hexcal {
namespace {

CalibrationModel identified_model() {
  CalibrationModel model;
  model.method = CompensationMethod::kinematic;
  model.nominal = surrogate_hexapod();
  model.machine = as_built(model.nominal, {}, 3);
  return model;
}

TEST(ControllerExport, LinuxCncGivesTheSameLegs) {
  CalibrationModel model = identified_model();
  for (const bool screws : {false, true}) {
    if (screws) model.machine.geometry.screw = screw_with_tangential_axes(model.nominal, 4);
    const PlatformGeometry again = parse_linuxcnc(linuxcnc_text("# head\n", model), model.nominal);
    for (const Pose& pose : random_poses(20, {}, 4)) {
      EXPECT_THAT(readings_at(again, again.B_from_P(pose)),
                  MatrixNear(machine_readings(model.machine, pose), 1e-10));
    }
  }
}

TEST(ControllerExport, LinuxCncRefusesWhatItCannotHold) {
  CalibrationModel model = identified_model();
  model.machine.sag[0] = 0.1;
  EXPECT_THAT([&] { (void)linuxcnc_text("", model); }, ThrowsInputError("no stroke curves"));
  model.method = CompensationMethod::option3;
  EXPECT_THAT([&] { (void)linuxcnc_text("", model); }, ThrowsInputError("wanted kinematic"));
}

TEST(ControllerExport, GcsKeepsPosesAndSaysWhichAreLost) {
  std::vector<PoseRecord> records;
  const std::vector<Pose> poses = random_poses(10, {}, 4);
  for (const Pose& pose : poses) {
    PoseRecord record;
    record.id = fmt::format("p{}", records.size());
    record.pose = pose;
    records.push_back(record);
  }
  PoseRecord lost;
  lost.id = "lost";
  lost.status = "leg 1 too long";
  records.push_back(lost);
  const std::string text = pi_gcs_text("# head\n", records);
  const std::vector<Pose> again = parse_pi_gcs(text);
  ASSERT_EQ(again.size(), poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i)
    EXPECT_THAT(home_from_lg(again[i]), RigidNear(home_from_lg(poses[i]), 1e-6, 1e-6));
  EXPECT_NE(text.find("# lost: leg 1 too long"), std::string::npos);
}

}  // namespace
}  // namespace hexcal
