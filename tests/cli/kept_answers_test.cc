#include <gmock/gmock.h>

#include <fstream>
#include <regex>

#include "tests/support/output_files.h"
#include "tests/support/run_hexcal.h"
#include "tests/support/sample_campaign.h"
#include "tools/io/kept_text.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

void put(const fs::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

TEST(KeptText, EveryByteThatIsChangedIsNoticed) {
  for (const auto& [sealed, open] : {std::pair(sealed_text("a,1.5\nb,2\n"), &unsealed_text),
                                     {sealed_json(R"({"a": 1})"), &unsealed_json}}) {
    ASSERT_TRUE(open(sealed));
    for (std::size_t i = 0; i < sealed.size(); ++i) {
      std::string other = sealed;
      other[i] = static_cast<char>(other[i] ^ 1);
      EXPECT_FALSE(open(other)) << i;
    }
    EXPECT_FALSE(open(sealed + " "));
    EXPECT_FALSE(open(sealed.substr(0, sealed.size() - 1)));
    EXPECT_FALSE(open(""));
  }
}

// The sample's home and one pose, measured.
class KeptAnswers : public ::testing::Test {
 protected:
  void SetUp() override {
    copy_sample_campaign(lab_, {"home", "p001"});
    ASSERT_EQ(measure().exit_code, 0);
    poses_ = contents(results_ / "poses.csv");
  }
  CommandResult measure(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments{"measure", lab_.string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_hexcal(arguments);
  }

  TemporaryFolder folder_;
  fs::path lab_ = folder_.path() / "lab";
  fs::path results_ = lab_ / "results";
  std::string poses_;
};

TEST_F(KeptAnswers, AMarkerThatWasMovedInTheCacheIsMeasuredAgain) {
  for (const auto& entry : fs::directory_iterator(results_ / "cache")) {
    std::string text = contents(entry.path());
    if (entry.path().extension() != ".txt") {
      fs::remove(entry.path());
      continue;
    }
    const std::size_t digit = text.find('.', text.find("\nmarker,")) + 1;
    text[digit] = text[digit] == '9' ? '8' : static_cast<char>(text[digit] + 1);  // by 0.1 px
    put(entry.path(), text);
  }
  fs::remove(results_ / "poses.csv");
  EXPECT_EQ(measure().exit_code, 0);
  EXPECT_EQ(contents(results_ / "poses.csv"), poses_);
}

TEST_F(KeptAnswers, AKeptExitCodeOrWordThatWasChangedIsNotReturned) {
  const fs::path kept = results_ / "cache" / "measurement.json";
  const std::string text = contents(kept);
  for (const auto& [from, to] :
       {std::pair("\"exit_code\": 0", "\"exit_code\": 77"), std::pair("p001", "p009")}) {
    put(kept, std::regex_replace(text, std::regex(from), to));
    const CommandResult again = measure();
    EXPECT_EQ(again.exit_code, 0);
    EXPECT_THAT(again.out, ::testing::Not(HasSubstr("p009")));
  }
}

TEST_F(KeptAnswers, APosesTableOfAnotherMeasurementIsNamed) {
  fs::remove(lab_ / "poses" / "p001" / "DSC_0004.jpg");
  ASSERT_EQ(measure({"-o", (lab_ / "elsewhere.csv").string()}).exit_code, 0);
  ASSERT_EQ(contents(results_ / "poses.csv"), poses_);  // old, beside new covariances
  const auto names_both =
      AllOf(HasSubstr("poses.csv"), HasSubstr("poses_covariance.csv"), HasSubstr("of another measurement"));
  for (const char* command : {"compensate", "report"}) {
    const CommandResult refused = run_hexcal({command, lab_.string()});
    EXPECT_EQ(refused.exit_code, 2) << command;
    EXPECT_THAT(refused.err, names_both);
  }
  const CommandResult evaluated =
      run_hexcal({"evaluate", "--targets", (lab_ / "targets.csv").string(), "--before",
                  (results_ / "poses.csv").string(), "--after", (lab_ / "elsewhere.csv").string()});
  EXPECT_EQ(evaluated.exit_code, 0) << evaluated.err;  // may be meant: before and after
  EXPECT_THAT(evaluated.err, names_both);
}

TEST_F(KeptAnswers, PhotographsOfOneNameInTwoFoldersStayApart) {
  const fs::path poses = lab_ / "poses";
  for (const char* session : {"s1", "s2"}) {
    fs::create_directories(poses / session / "a");
    const fs::path from = poses / (std::string(session) == "s1" ? "home" : "p001");
    int number = 0;
    for (const auto& entry : fs::directory_iterator(from))
      fs::copy(entry.path(), poses / session / "a" / (std::to_string(number++) + ".jpg"));
  }
  fs::remove_all(poses / "home");
  fs::remove_all(poses / "p001");
  const std::string observations = (lab_ / "o.txt").string();
  std::string campaign = contents(lab_ / "campaign.yaml");
  campaign.replace(campaign.find("pose: home"), 10, "pose: s1/a");
  put(lab_ / "campaign.yaml", campaign);
  ASSERT_EQ(run_hexcal({"detect", (poses / "s1").string(), (poses / "s2").string(), "--camera",
                        (lab_ / "camera.yaml").string(), "-o", observations})
                .exit_code,
            0);
  const CommandResult by_file = measure({"--observations", observations});
  EXPECT_EQ(by_file.exit_code, 0) << by_file.out << by_file.err;
  EXPECT_THAT(contents(results_ / "poses.csv"), AllOf(HasSubstr("s1/a,ok"), HasSubstr("s2/a,ok")));

  // Two files in one, as people join them: refused by name.
  put(observations, contents(observations) +
                        contents(observations).substr(contents(observations).find("\nphotograph,") + 1));
  const CommandResult twice = measure({"--observations", observations});
  EXPECT_EQ(twice.exit_code, 2);
  EXPECT_THAT(twice.err, HasSubstr("photograph 's1/a/0.jpg' stands twice"));
}

}  // namespace
}  // namespace hexcal
