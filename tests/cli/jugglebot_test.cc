// A real hexapod (Project-DeepBlue-Juggling/Jugglebot, MIT): encoder readings in revolutions and poses by
// motion capture in a frame and on a target of unknown place. Identified through the program as a user would.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "calibration/calibration_model.h"
#include "calibration/statistics.h"
#include "kinematics/dh_chain.h"
#include "tests/support/hexapods.h"
#include "tests/support/run_hexcal.h"
#include "tools/io/csv_table.h"
#include "tools/io/hexapod_file.h"
#include "tools/io/model_file.h"
#include "tools/io/pose_table.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr const char* kData = HEXCAL_SOURCE "/../shared/data/jugglebot";

struct Recording {
  std::vector<PoseRecord> poses;
  std::vector<LegRecord> legs;
};

Recording read_recording(const fs::path& path) {
  const CsvTable table = CsvTable::read(path);
  Recording recording;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const std::string id = fmt::format("p{}", row + 1);
    const Eigen::Quaterniond q(table.number(row, "orientation_w"), table.number(row, "orientation_x"),
                               table.number(row, "orientation_y"), table.number(row, "orientation_z"));
    PoseRecord pose;
    pose.id = id;
    pose.pose = Pose{
        {table.number(row, "position_x"), table.number(row, "position_y"), table.number(row, "position_z")},
        rpy_from_quaternion(q.normalized())};
    recording.poses.push_back(pose);
    Vector6d readings;
    for (Eigen::Index k = 0; k < 6; ++k) readings[k] = table.number(row, fmt::format("leg_length_{}", k + 1));
    recording.legs.push_back({id, "ok", readings});
  }
  return recording;
}

PlatformGeometry nominal_in_revolutions() {
  PlatformGeometry g = jugglebot_hexapod();
  // Scales measured by hand, 1e-3 rev/mm.
  const std::array<double, 6> rev_per_m{13.21144, 14.0456, 13.8233, 14.124109, 14.16007, 14.03256};
  for (std::size_t i = 0; i < 6; ++i) g.actuators[i].mm_per_unit = 1000 / rev_per_m[i];
  return g;
}

class Jugglebot : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kData)) GTEST_SKIP() << "no recordings";
  }
  fs::path write(const std::string& name, const std::string& text) {
    std::ofstream(folder_.path() / name) << text;
    return folder_.path() / name;
  }
  // Trains on the poses given; returns what the program printed.
  CommandResult train(const std::string& poses, const std::vector<LegRecord>& readings) {
    const fs::path hexapod = write("hexapod.yaml", hexapod_text("", nominal_in_revolutions()));
    const fs::path legs = write("legs.csv", format_leg_table("", readings, false));
    return run_hexcal({"compensate", "--frames", "unknown", "--legs", legs, "--poses",
                       write("poses.csv", poses), "--hexapod", hexapod, "-o", folder_.path()});
  }
  // Errors of the model at another recording, whose measurement frame alone is fitted.
  ErrorStatistics test_model(const Recording& recording) const {
    const CalibrationModel model = read_model_file(folder_.path() / "model.yaml");
    std::vector<Rigid3> predicted;
    std::vector<Rigid3> turns;
    for (const LegRecord& leg : recording.legs) {
      const auto pose = pose_for_readings(model, *leg.readings);
      EXPECT_TRUE(pose);
      if (!pose) return {};
      predicted.push_back(home_from_lg(*pose));
    }
    for (std::size_t i = 0; i < predicted.size(); ++i) {
      const Rigid3 seen = home_from_lg(*recording.poses[i].pose);
      turns.push_back(Rigid3::from_rotation(seen.rotation * predicted[i].rotation.conjugate()));
    }
    const Eigen::Quaterniond turn = mean_rotation(turns);
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < predicted.size(); ++i) {
      shift += (recording.poses[i].pose->position_mm - turn * predicted[i].translation) /
               static_cast<double>(predicted.size());
    }
    std::vector<PosePair> pairs;
    for (std::size_t i = 0; i < predicted.size(); ++i) {
      pairs.push_back({*recording.poses[i].pose, pose_from_home_from_lg(Rigid3(turn, shift) * predicted[i])});
    }
    return error_statistics(pairs);
  }
  TemporaryFolder folder_;
};

TEST_F(Jugglebot, OneRecordingPredictsTheOther) {
  const Recording recording = read_recording(fs::path(kData) / "jugglebot_108_calibration_poses.csv");
  const CommandResult printed =
      train(format_pose_table("", recording.poses, PoseColumns::target), recording.legs);
  ASSERT_LE(printed.exit_code, 1) << printed.err;
  EXPECT_THAT(printed.out, HasSubstr("! leg 1: scale -6"));
  const ErrorStatistics errors =
      test_model(read_recording(fs::path(kData) / "jugglebot_60_calibration_poses.csv"));
  RecordProperty("position_rms_mm", std::to_string(errors.position_rms_mm));
  RecordProperty("orientation_rms_deg", std::to_string(errors.orientation_rms_rad * kDegPerRad));
  EXPECT_LE(errors.position_rms_mm, 0.67);
  EXPECT_LE(errors.orientation_rms_rad * kDegPerRad, 0.13);
}

// One pose in twelve jumps by centimetres, one in ten has lost its orientation.
TEST_F(Jugglebot, BadPosesAndMissingCoordinatesDoLittleHarm) {
  Recording recording = read_recording(fs::path(kData) / "jugglebot_108_calibration_poses.csv");
  for (std::size_t i = 4; i < recording.poses.size(); i += 12) {
    recording.poses[i].pose->position_mm += Eigen::Vector3d(20, -15, 10);
    recording.poses[i].pose->rpy_rad.x() += 4 * kRadPerDeg;
  }
  std::string poses = "pose,z_mm,note,y_mm,x_mm,yaw_deg,pitch_deg,roll_deg\n";
  for (std::size_t i = 0; i < recording.poses.size(); ++i) {
    const Pose& pose = *recording.poses[i].pose;
    const Eigen::Vector3d deg = pose.rpy_rad * kDegPerRad;
    poses += fmt::format("{},{},a note,{},{},", recording.poses[i].id, pose.position_mm.z(),
                         pose.position_mm.y(), pose.position_mm.x());
    poses += i % 10 == 0 ? ",,\n" : fmt::format("{},{},{}\n", deg.z(), deg.y(), deg.x());
  }
  const CommandResult printed = train(poses, recording.legs);
  ASSERT_LE(printed.exit_code, 1) << printed.err;
  EXPECT_THAT(printed.out, HasSubstr("fit no method and are left out of the comparison: p5, p17, p29"));
  EXPECT_THAT(printed.out, HasSubstr("! leg 1: scale -6"));
  const ErrorStatistics errors =
      test_model(read_recording(fs::path(kData) / "jugglebot_60_calibration_poses.csv"));
  EXPECT_LE(errors.position_rms_mm, 0.7);
  EXPECT_LE(errors.orientation_rms_rad * kDegPerRad, 0.14);
}

}  // namespace
}  // namespace hexcal
