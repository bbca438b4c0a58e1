#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/run_hexcal.h"

namespace hexcal {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(Cli, PrintsItsVersion) {
  const CommandResult result = run_hexcal({"--version"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, StartsWith("hexcal "));
}

TEST(Cli, RefusesAnUnknownCommandInOneLine) {
  const CommandResult result = run_hexcal({"measrue"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
}

TEST(Cli, WithoutACommandSaysWhatIsWanted) {
  const CommandResult result = run_hexcal({});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("--help"));
}

}  // namespace
}  // namespace hexcal
