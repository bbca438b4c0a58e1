#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "tests/support/run_hexcal.h"

namespace hexcal {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

bool has_program(const std::string& name) {
  return std::system(("command -v " + name + " >/dev/null 2>&1").c_str()) == 0;
}

// Standard output and error of a shell command fed with `input`.
std::string shell_output(const std::string& command, const std::string& input) {
  const TemporaryFolder folder;
  const std::string in = (folder.path() / "in").string();
  const std::string out = (folder.path() / "out").string();
  std::ofstream(in) << input;
  EXPECT_EQ(std::system((command + " <" + in + " >" + out + " 2>&1").c_str()), 0) << command;
  return contents(out);
}

TEST(Completion, BashOffersCommandsOptionsAndChoices) {
  const std::string script = run_hexcal({"completion", "bash"}).out;
  const auto complete = [&](const std::string& words, int index) {
    return shell_output("bash", script + "COMP_WORDS=(" + words + ")\nCOMP_CWORD=" + std::to_string(index) +
                                    "\n_hexcal\necho \"${COMPREPLY[@]}\"\n");
  };
  EXPECT_EQ(complete("hexcal eval", 1), "evaluate\n");
  EXPECT_EQ(complete("hexcal evaluate --bef", 2), "--before\n");
  EXPECT_EQ(complete("hexcal completion fi", 2), "fish\n");
}

TEST(Completion, ZshAndFishScriptsParse) {
  for (const std::string shell : {"zsh", "fish"}) {
    const CommandResult result = run_hexcal({"completion", shell});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.out, HasSubstr("evaluate"));
    if (has_program(shell)) {
      EXPECT_THAT(shell_output(shell + " -n", result.out), IsEmpty());
    }
  }
}

// A command's description is one line of the help: its second line would be a sample that fell out of place.
TEST(Completion, HelpHasOneLineACommand) {
  std::istringstream help(run_hexcal({"--help"}).out);
  int commands = 0;
  bool listing = false;
  for (std::string line; std::getline(help, line);) {
    if (listing && !line.empty()) {
      EXPECT_THAT(line, testing::MatchesRegex("  [a-z]+ +[A-Z].*"));
      EXPECT_LE(line.size(), 115U) << line;
      ++commands;
    }
    listing = listing || line == "Subcommands:";
  }
  EXPECT_GE(commands, 17);
}

TEST(Completion, ManualPageHoldsEveryCommandOfTheHelpAndSetsWithoutWarnings) {
  const std::string page = run_hexcal({"completion", "man"}).out;
  EXPECT_THAT(page, HasSubstr(".SS \"hexcal evaluate\""));
  EXPECT_THAT(page, HasSubstr("\\-\\-targets"));
  if (!has_program("groff")) GTEST_SKIP() << "groff is not installed";
  EXPECT_THAT(shell_output("groff -man -ww -z -Tutf8", page), IsEmpty());
}

}  // namespace
}  // namespace hexcal
