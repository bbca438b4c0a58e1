#include "tools/io/calibration_record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/report/sample_report.h"
#include "tests/support/temporary_folder.h"

namespace hexcal {
namespace {

class CalibrationRecord : public ::testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path path() const { return folder_.path() / "calibration.json"; }

  // The sample's, with an identified machine.
  static CampaignReport identified_report() {
    CampaignReport report = sample_report();
    CalibrationReport& calibration = report.compensation->calibration;
    calibration.fitted.identified.emplace().stroke_range.setZero();
    calibration.fitted.identified->sigma0_of_measurement = 1.02;
    calibration.fitted.identified->leg_sigma_mm = 0.001;
    Identifiability judged;
    judged.free_parameters = 48;
    judged.condition = std::numeric_limits<double>::infinity();
    judged.parameters = {{"leg 1 base x", "mm", 1.5, 0.01, std::numeric_limits<double>::infinity()}};
    judged.correlations = {{"leg 1 base z", "leg 1 offset", -0.999}};
    judged.weak = {{0.5, {"leg 1 base z"}}};
    judged.legs = {{1, 2.5, true, "leg 1: scale -6.0 % +- 0.1 %"}};
    judged.beyond_geometry = {"backlash of the legs 0.05 mm"};
    calibration.identifiability = judged;
    return report;
  }

  void write(const std::string& key) const {
    write_file_atomically(path(),
                          calibration_record_text(key, identified_report().compensation->calibration));
  }

  TemporaryFolder folder_;
};

TEST_F(CalibrationRecord, GivesTheSamePageByteForByte) {
  write("key");
  CampaignReport report = sample_report();
  report.compensation->calibration = read_calibration_record(path(), "key").value();
  EXPECT_EQ(render_page(campaign_page(report)), render_page(campaign_page(identified_report())));
}

TEST_F(CalibrationRecord, OfOtherInputsOrDamagedIsNone) {
  EXPECT_FALSE(read_calibration_record(path(), "key"));
  write("key");
  EXPECT_FALSE(read_calibration_record(path(), "other"));
  write_file_atomically(path(), R"({"key": "key", "chosen": 3})");
  EXPECT_FALSE(read_calibration_record(path(), "key"));
}

TEST_F(CalibrationRecord, KeyFollowsTheContentOfEveryFileAndTheSettings) {
  ObservationFiles files;
  files.poses = folder_.path() / "poses.csv";
  write_file_atomically(files.poses, "a");
  const std::filesystem::path hexapod = folder_.path() / "hexapod.yaml";
  write_file_atomically(hexapod, "b");
  const std::string key = calibration_key("1", hexapod, files, "auto");
  EXPECT_EQ(calibration_key("1", hexapod, files, "auto"), key);
  EXPECT_NE(calibration_key("1", hexapod, files, "option1"), key);
  write_file_atomically(files.poses, "c");
  EXPECT_NE(calibration_key("1", hexapod, files, "auto"), key);
}

}  // namespace
}  // namespace hexcal
