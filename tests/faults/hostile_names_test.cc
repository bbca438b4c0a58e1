#include <gmock/gmock.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/faults/fault_campaign.h"
#include "tools/io/observations_file.h"

// Names of folders and files that are markup, formulas, flags, several lines or no UTF-8.

namespace hexcal {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

class HostileNames : public ::testing::Test {
 protected:
  void rename_pose(const std::string& from, const std::string& to) const {
    fs::rename(lab_.poses() / from, lab_.poses() / to);
  }
  // Measures, reads every output as a program would and makes the report.
  void measure_and_read(const std::vector<std::string>& poses) const {
    const Outcome outcome = lab_.measure({"--json"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    for (const std::string& pose : poses) EXPECT_EQ(outcome.pose(pose).status, "ok");
    EXPECT_TRUE(nlohmann::json::accept(outcome.out));
    EXPECT_TRUE(nlohmann::json::accept(contents(lab_.folder() / "results" / "quality.json")));
    EXPECT_EQ(read_observations(lab_.folder() / "results" / "observations.txt").photographs.size(), 12U);
    const CommandResult report = run_hexcal({"report", lab_.folder().string()});
    EXPECT_EQ(report.exit_code, 0) << report.err;
  }
  [[nodiscard]] std::string page() const { return contents(lab_.folder() / "results" / "report.html"); }

  FaultCampaign lab_;
};

TEST_F(HostileNames, MarkupAndFormulasStayText) {
  rename_pose("p001", "<script>alert(1)<");
  rename_pose("p002", "\"><img src=x onerror=alert(2)>");
  rename_pose("p003", "=cmd()|' &lt;");
  fs::rename(lab_.photographs("home")[0], lab_.poses() / "home" / "<svg onload=alert(3)>.jpg");
  measure_and_read({"home", "<script>alert(1)<", "\"><img src=x onerror=alert(2)>", "=cmd()|' &lt;"});
  for (const char* live : {"<script>alert", "<img src=x", "<svg onload", "\"><img"})
    EXPECT_THAT(page(), Not(HasSubstr(live)));
  EXPECT_THAT(page(), HasSubstr("&lt;script&gt;alert(1)&lt;"));
  // What a table holds is the users'; only the quoting is ours.
  EXPECT_THAT(contents(lab_.folder() / "results" / "poses.csv"), HasSubstr("\n=cmd()|' &lt;,ok,"));
  EXPECT_THAT(contents(lab_.folder() / "results" / "poses.csv"),
              HasSubstr("\n\"\"\"><img src=x onerror=alert(2)>\",ok,"));
}

TEST_F(HostileNames, NoUtf8LineBreaksBlanksAndDashes) {
  rename_pose("p001", "caf\xE9 \xFF");
  rename_pose("p002", "two\nlines, \"quoted\"");
  rename_pose("p003", "--json");
  fs::rename(lab_.photographs("home")[0], lab_.poses() / "home" / "-o \xC3\x28\n#.jpg");
  fs::rename(lab_.folder() / "camera.yaml",
             lab_.folder() / "cam\nera \xC3\xA9.yaml");  // YAML holds UTF-8 only
  lab_.replace("campaign.yaml", "camera: camera.yaml", "camera: \"cam\\nera \\xE9.yaml\"");
  // Control characters of names are written out as they enter a table.
  measure_and_read({"home", "caf\xE9 \xFF", "two\\x0Alines, \"quoted\"", "--json"});
  // One comment line, however the inputs are called.
  const std::string table = contents(lab_.folder() / "results" / "poses.csv");
  EXPECT_THAT(table.substr(0, table.find('\n')), HasSubstr("cam\\x0Aera \xC3\xA9.yaml sha256:"));
}

TEST_F(HostileNames, AnErrorIsOneLineThatNoTerminalObeys) {
  const CommandResult result = run_hexcal({"measure", "/no/such\nfolder\x1B[2J"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("/no/such\\x0Afolder\\x1B[2J"));
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1);
}

TEST_F(HostileNames, ACampaignMayBeginWithADash) {
  const fs::path before = fs::current_path();
  fs::rename(lab_.folder() / "targets.csv", lab_.folder() / "unused.csv");
  lab_.replace("campaign.yaml", "targets: targets.csv\n", "");
  fs::current_path(lab_.folder().parent_path());
  fs::create_directory_symlink("lab", "-lab");
  const CommandResult result = run_hexcal({"run", "--", "-lab"});
  fs::current_path(before);
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_TRUE(fs::exists(lab_.folder() / "results" / "report.html"));
}

}  // namespace
}  // namespace hexcal
