#include <gmock/gmock.h>

#include "tests/support/output_files.h"
#include "tests/support/run_hexcal.h"
#include "tests/support/sample_campaign.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Watch : public ::testing::Test {
 protected:
  void SetUp() override { copy_sample_campaign(lab_, {"home"}); }

  CommandResult watch(std::vector<std::string> more = {}) const {
    std::vector<std::string> arguments{"watch", lab_.string(), "--stop-after", "0.1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_hexcal(arguments);
  }

  TemporaryFolder folder_;
  fs::path lab_ = folder_.path() / "lab";
};

// What it takes up from its own poses.csv is no input that it must not write over.
TEST_F(Watch, StartedAgainItAddsWhatIsNew) {
  ASSERT_EQ(watch().exit_code, 0);
  const fs::path pose = fs::path("poses") / "p001";
  fs::copy(fs::path(HEXCAL_SOURCE) / "samples" / "small_lab" / pose, lab_ / pose,
           fs::copy_options::recursive);
  const CommandResult again = watch();
  EXPECT_EQ(again.exit_code, 0) << again.out << again.err;
  const std::string poses = contents(lab_ / "results" / "poses.csv");
  EXPECT_THAT(poses, HasSubstr("p001,ok"));
  const CommandResult measured = run_hexcal({"measure", lab_.string()});
  EXPECT_EQ(measured.exit_code, 0) << measured.err;
  EXPECT_EQ(contents(lab_ / "results" / "poses.csv"), poses);
}

TEST_F(Watch, AFaultThatStaysToTheEndIsSaidAndIsTheExitCode) {
  const CommandResult result = watch({"-o", (lab_ / "targets.csv").string()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("targets.csv: "));
}

}  // namespace
}  // namespace hexcal
