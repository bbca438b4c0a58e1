#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>

#include "tests/support/run_hexcal.h"
#include "tests/support/sample_campaign.h"

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

TEST_F(Measure, ATruncatedPhotographIsLeftOutAndNamed) {
  fs::resize_file(lab_ / "poses" / "p001" / "DSC_0004.jpg", 30000);
  const CommandResult result = measure();
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("photograph p001/DSC_0004.jpg: unreadable"));
  EXPECT_THAT(contents(lab_ / "results" / "poses.csv"), HasSubstr("p001,ok"));
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
  ASSERT_EQ(run_hexcal({"measure", lab_.string(), "--threads", "1"}).exit_code, 0);
  EXPECT_EQ(contents(lab_ / "results" / "poses.csv"), first);
  ASSERT_EQ(run_hexcal({"measure", lab_.string(), "--threads", "1", "--no-cache"}).exit_code, 0);
  EXPECT_EQ(contents(lab_ / "results" / "poses.csv"), first);
  EXPECT_EQ(contents(lab_ / "results" / "poses_covariance.csv"), covariance);
}

}  // namespace
}  // namespace hexcal
