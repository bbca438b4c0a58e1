#include "tools/io/calibration_record.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "tests/support/temporary_folder.h"

namespace hexcal {
namespace {

// What was not measured is no number, and a record that holds it is as good as any.
TEST(CalibrationRecord, HoldsWhatWasNotMeasuredAndADoubt) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  CalibrationReport report;
  CrossValidation method;
  method.name = "kinematic";
  method.method = CompensationMethod::kinematic;
  method.errors.position_rms_mm = 0.25;
  method.errors.orientation_rms_rad = kNone;
  method.errors.rms << 0.1, kNone, 0.2, kNone, kNone, kNone;
  method.orientation_rms_se_rad = kNone;
  method.predicted = PredictedOverAll{0.4, 0.001};
  report.comparison.methods.push_back(method);
  report.chosen = "kinematic";
  report.doubt = MachineDoubt{"far off", "y has the other sign", "turn it round"};
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "calibration.json";
  std::ofstream(path) << calibration_record_text("key", report);
  EXPECT_FALSE(read_calibration_record(path, "another"));
  const auto back = read_calibration_record(path, "key");
  ASSERT_TRUE(back);
  const CrossValidation& again = back->comparison.methods.at(0);
  EXPECT_EQ(again.errors.position_rms_mm, 0.25);
  EXPECT_TRUE(std::isnan(again.errors.orientation_rms_rad));
  EXPECT_EQ(again.errors.rms[2], 0.2);
  EXPECT_TRUE(std::isnan(again.errors.rms[1]));
  EXPECT_TRUE(std::isnan(again.orientation_rms_se_rad));
  EXPECT_EQ(again.predicted->position_mm, 0.4);
  EXPECT_EQ(back->doubt->cause(), "far off: y has the other sign");
  EXPECT_EQ(back->doubt->instruction, "turn it round");
}

}  // namespace
}  // namespace hexcal
