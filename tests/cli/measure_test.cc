#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <map>

#include "tests/support/output_files.h"
#include "tests/support/run_hexcal.h"
#include "tests/support/sample_campaign.h"
#include "tools/io/pose_table.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

// Home and one pose of the sample campaign, with one thing spoilt by the test.
class Measure : public ::testing::Test {
 protected:
  void SetUp() override { copy_sample_campaign(lab_, {"home", "p001"}); }

  void replace(const std::string& file, const std::string& old_text, const std::string& new_text) {
    std::string text = contents(lab_ / file);
    const std::size_t at = text.find(old_text);
    ASSERT_NE(at, std::string::npos) << old_text;
    text.replace(at, old_text.size(), new_text);
    std::ofstream(lab_ / file, std::ios::binary) << text;
  }

  [[nodiscard]] CommandResult measure() const { return run_hexcal({"measure", lab_.string()}); }

  // A refusal: exit code 2, one line of words on stderr, and not a file written.
  void expect_refused(const ::testing::Matcher<std::string>& words) const {
    const CommandResult result = measure();
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, words);
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(fs::exists(lab_ / "results" / "poses.csv"));
  }

  TemporaryFolder folder_;
  fs::path lab_ = folder_.path() / "lab";
};

TEST_F(Measure, AMisspeltKeyIsNamedWithItsLine) {
  replace("campaign.yaml", "camera:", "camra:");
  expect_refused(AllOf(HasSubstr("campaign.yaml:2"), HasSubstr("camera: missing"), HasSubstr("'camra'")));
}

TEST_F(Measure, AnUnknownKeyIsNamedWithTheNearestOne) {
  replace("campaign.yaml", "images:", "legz: legs.csv\nimages:");
  expect_refused(AllOf(HasSubstr("unknown key 'legz'"), HasSubstr("did you mean 'legs'")));
}

TEST_F(Measure, AMissingSizeIsNamed) {
  replace("campaign.yaml", "fixed:  {ids: [0-9], size_mm: 24}", "fixed:  {ids: [0-9]}");
  expect_refused(HasSubstr("markers.fixed.size_mm: missing"));
}

TEST_F(Measure, AWordInANumberColumnIsNamedWithFileLineAndColumn) {
  replace("markers_nominal.csv", "20.631846", "abc");
  expect_refused(
      AllOf(HasSubstr("markers_nominal.csv:3: column 'x_mm'"), HasSubstr("'abc' is not a number")));
}

TEST_F(Measure, ACameraOfAnotherImageSizeIsRefusedWithBothSizes) {
  replace("camera.yaml", "1504", "1500");
  expect_refused(
      AllOf(HasSubstr("none of the 6 photographs"), HasSubstr("1504 x 1000"), HasSubstr("1500 x 1000")));
}

TEST_F(Measure, TwoPhotographsNeverShareAnOverlay) {
  const fs::path from = lab_ / "poses" / "p001";
  for (const char* name : {"x/y_1.jpg", "x_y/1.jpg", "x/1.jpg"}) {
    fs::create_directories((lab_ / "poses" / name).parent_path());
    fs::copy(from / "DSC_0004.jpg", lab_ / "poses" / name);
  }
  const std::string long_name(150, 'n');
  fs::create_directories(lab_ / "poses" / long_name);
  fs::copy(from / "DSC_0004.jpg", lab_ / "poses" / long_name / (long_name + ".jpg"));
  const CommandResult result = run_hexcal({"measure", lab_.string(), "--overlays"});
  EXPECT_EQ(result.exit_code, 1) << result.err;  // photographs that stand twice
  std::size_t overlays = 0;
  for (const auto& entry : fs::directory_iterator(lab_ / "results" / "overlays"))
    overlays += entry.is_regular_file();
  EXPECT_EQ(overlays, 10U);
}

TEST_F(Measure, ATruncatedPhotographIsLeftOutAndNamed) {
  fs::resize_file(lab_ / "poses" / "p001" / "DSC_0004.jpg", 30000);
  const CommandResult result = measure();
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("photograph p001/DSC_0004.jpg: unreadable"));
  EXPECT_THAT(contents(lab_ / "results" / "poses.csv"), HasSubstr("p001,ok"));
  EXPECT_GT(expect_finite_numbers(lab_ / "results"), 8);
}

TEST_F(Measure, APoseThatFailsLeavesEmptyCellsAndNoNan) {
  for (const fs::directory_entry& entry : fs::directory_iterator(lab_ / "poses" / "p001")) {
    fs::resize_file(entry.path(), 30000);
  }
  EXPECT_EQ(measure().exit_code, 1);
  EXPECT_THAT(contents(lab_ / "results" / "poses.csv"),
              AllOf(HasSubstr("p001,no_usable_photographs: "), HasSubstr("file,,,,,,,,,,,,,0,0,,")));
  EXPECT_GT(expect_finite_numbers(lab_ / "results"), 8);
}

// Every file of the results; the cache is no result.
std::map<std::string, std::string> result_files(const fs::path& results) {
  std::map<std::string, std::string> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(results)) {
    if (entry.is_regular_file()) files[entry.path().filename().string()] = contents(entry.path());
  }
  return files;
}

TEST_F(Measure, OneTwoAndFourThreadsWriteTheSameBytes) {
  std::map<std::string, std::string> first;
  for (const char* threads : {"1", "2", "4", "4"}) {
    ASSERT_EQ(run_hexcal({"measure", lab_.string(), "--no-cache", "--threads", threads}).exit_code, 0);
    if (first.empty()) first = result_files(lab_ / "results");
    EXPECT_EQ(result_files(lab_ / "results"), first) << threads;
  }
  EXPECT_GT(first.size(), 8u);
}

TEST_F(Measure, OnePhotographOfAPoseGivesAPoseWithALargerSigma) {
  fs::remove(lab_ / "poses" / "p001" / "DSC_0004.jpg");
  fs::remove(lab_ / "poses" / "p001" / "DSC_0005.jpg");
  const CommandResult result = measure();
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, HasSubstr("one photograph only"));
}

TEST_F(Measure, ASecondRunTakesTheDetectionsFromTheCacheAndGivesTheSameBytes) {
  ASSERT_EQ(measure().exit_code, 0);
  const std::string first = contents(lab_ / "results" / "poses.csv");
  const std::string covariance = contents(lab_ / "results" / "poses_covariance.csv");
  fs::remove(lab_ / "results" / "cache" / "measurement.json");
  ASSERT_EQ(run_hexcal({"measure", lab_.string(), "--threads", "1"}).exit_code, 0);
  EXPECT_EQ(contents(lab_ / "results" / "poses.csv"), first);
  ASSERT_EQ(run_hexcal({"measure", lab_.string(), "--threads", "1", "--no-cache"}).exit_code, 0);
  EXPECT_EQ(contents(lab_ / "results" / "poses.csv"), first);
  EXPECT_EQ(contents(lab_ / "results" / "poses_covariance.csv"), covariance);
}

TEST_F(Measure, PosesOnAMapOfTheMarkersAreThoseOfOneAdjustmentWithinTheirSigmas) {
  copy_sample_campaign(lab_ / "more", {"p002", "p003", "p004"});
  for (const char* pose : {"p002", "p003", "p004"}) {
    fs::rename(lab_ / "more" / "poses" / pose, lab_ / "poses" / pose);
  }
  ASSERT_EQ(measure().exit_code, 0);
  const auto at_once = read_pose_table(lab_ / "results" / "poses.csv");
  ASSERT_EQ(run_hexcal({"measure", lab_.string(), "--map-poses", "3"}).exit_code, 0);
  const auto by_map = read_pose_table(lab_ / "results" / "poses.csv");
  ASSERT_EQ(by_map.size(), at_once.size());
  for (std::size_t i = 1; i < by_map.size(); ++i) {
    ASSERT_TRUE(by_map[i].pose && by_map[i].sigma);
    for (int k = 0; k < 6; ++k) {
      const double sigma = (*by_map[i].sigma)[k];
      EXPECT_NEAR(by_map[i].pose->vector()[k], at_once[i].pose->vector()[k], 4 * sigma) << i << " " << k;
      EXPECT_GE(sigma, 0.8 * (*at_once[i].sigma)[k]) << i << " " << k;
    }
  }
  const CommandResult one = run_hexcal({"measure", lab_.string(), "--map-poses", "1"});
  EXPECT_EQ(one.exit_code, 2);
  EXPECT_THAT(one.err, HasSubstr("map_poses: found 1, wanted 2 or more"));
}

TEST_F(Measure, WithNothingChangedTheAnswerOfTheLastRunIsGiven) {
  const fs::path poses = lab_ / "results" / "poses.csv";
  const CommandResult first = measure();
  const CommandResult first_json = run_hexcal({"measure", lab_.string(), "--json"});
  const std::string bytes = contents(poses);
  const auto long_ago = fs::file_time_type::clock::now() - std::chrono::hours(1);
  fs::last_write_time(poses, long_ago);
  const CommandResult second = measure();
  EXPECT_EQ(second.out, first.out);
  EXPECT_EQ(second.exit_code, first.exit_code);
  EXPECT_EQ(run_hexcal({"measure", lab_.string(), "--json"}).out, first_json.out);
  EXPECT_EQ(fs::last_write_time(poses), long_ago) << "written again";

  const fs::path epochs = lab_ / "results" / "epochs.csv";
  const std::string whole = contents(epochs);
  std::ofstream(epochs) << "half";
  EXPECT_EQ(measure().out, first.out);
  EXPECT_EQ(contents(epochs), whole);
  EXPECT_EQ(contents(poses), bytes);

  std::ofstream(lab_ / "camera.yaml", std::ios::app) << "# read again\n";
  fs::last_write_time(poses, long_ago);
  ASSERT_EQ(measure().exit_code, 0);
  EXPECT_NE(fs::last_write_time(poses), long_ago);

  const fs::path photograph = fs::directory_iterator(lab_ / "poses" / "p001")->path();
  fs::last_write_time(poses, long_ago);
  std::ofstream(photograph, std::ios::in | std::ios::out).seekp(200) << "a few other bytes";
  (void)measure();
  EXPECT_NE(fs::last_write_time(poses), long_ago);

  fs::remove(photograph);
  EXPECT_NE(measure().out, first.out);
}

}  // namespace
}  // namespace hexcal
