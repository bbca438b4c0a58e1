#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/run_hexcal.h"
#include "tests/support/sample_campaign.h"
#include "tools/io/pose_table.h"

// What a person gets to see of a campaign in which something went wrong, on the built program: a named cause,
// one instruction, an exit code that follows, and never "send" to the controller.

namespace hexcal {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;
using Json = nlohmann::json;

void write(const fs::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

std::string replaced_all(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

// The sample campaign, its photographs measured once; each test spoils the observations or a file.
class Verdicts : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const TemporaryFolder folder;
    const fs::path lab = folder.path() / "lab";
    copy_sample_campaign(lab, {"home", "p001", "p002", "p003", "p004", "p005", "p006", "p007", "p008"});
    const CommandResult measured = run_hexcal({"measure", lab.string()});
    observations_ = measured.exit_code == 0 ? contents(lab / "results/observations.txt") : measured.err;
  }

  void SetUp() override {
    ASSERT_THAT(observations_, HasSubstr("p001/"));
    copy_sample_campaign(lab_);
  }

  // Measured, compensated and reported, as `run` does with photographs.
  CommandResult measure(const std::string& observations, const std::vector<std::string>& flags = {}) {
    write(folder_.path() / "observations.txt", observations);
    std::vector<std::string> arguments{"measure", lab_.string(), "--observations",
                                       (folder_.path() / "observations.txt").string()};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    return run_hexcal(arguments);
  }
  [[nodiscard]] CommandResult report() const { return run_hexcal({"report", lab_.string()}); }
  [[nodiscard]] std::map<std::string, PoseRecord> poses() const {
    std::map<std::string, PoseRecord> all;
    for (const PoseRecord& record : read_pose_table(lab_ / "results/poses.csv")) all[record.id] = record;
    return all;
  }
  [[nodiscard]] Json quality() const { return Json::parse(contents(lab_ / "results/quality.json")); }

  // The records of the photographs whose names begin with `prefix`, without the first `kept` of them.
  static std::string without(const std::string& observations, const std::string& prefix, int kept = 0) {
    std::string out;
    bool drop = false;
    std::istringstream lines(observations);
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("photograph")) {
        const std::size_t at = line.find(prefix);
        drop = at != std::string::npos && at < 20 && kept-- <= 0;
      }
      if (!drop) out += line + '\n';
    }
    return out;
  }

  static std::string observations_;
  TemporaryFolder folder_;
  fs::path lab_ = folder_.path() / "lab";
};

std::string Verdicts::observations_;

constexpr const char* kSend = "to the controller";

TEST_F(Verdicts, AGoodCampaignKeepsItsLimitsAndIsSent) {
  const std::vector<std::string> limits{"--max-mm", "0.05", "--max-deg", "0.05", "--max-rms-px", "0.5"};
  const CommandResult measured = measure(observations_, limits);
  EXPECT_EQ(measured.exit_code, 0) << measured.out << measured.err;
  EXPECT_EQ(run_hexcal({"compensate", lab_.string()}).exit_code, 0);
  const CommandResult reported = report();
  EXPECT_EQ(reported.exit_code, 0) << reported.out;
  EXPECT_THAT(reported.out, HasSubstr("next: Send `results/actuators.csv` to the controller"));
  // The sample's camera file states no covariance, which is a warning.
  EXPECT_EQ(quality()["verdict"], "warning");
  const CommandResult required = measure(observations_, {"--require", "good"});
  EXPECT_EQ(required.exit_code, 1);
  EXPECT_THAT(required.err, HasSubstr("limit: the verdict is not good"));
}

TEST_F(Verdicts, LimitsThatArePassedEndWithOne) {
  for (const auto& [flag, words] :
       std::vector<std::pair<std::string, std::string>>{{"--max-mm", "limit: position"},
                                                        {"--max-deg", "limit: orientation"},
                                                        {"--max-rms-px", "limit: residuals"}}) {
    const CommandResult result = measure(observations_, {flag, "1e-7"});
    EXPECT_EQ(result.exit_code, 1) << flag;
    EXPECT_THAT(result.err, HasSubstr(words));
  }
  const std::string targets = (lab_ / "targets.csv").string();
  const std::string measured = (lab_ / "results/poses.csv").string();
  EXPECT_EQ(run_hexcal({"evaluate", "--targets", targets, "--before", measured, "--max-mm", "100",
                        "--max-deg", "45"})
                .exit_code,
            0);
  const CommandResult past =
      run_hexcal({"evaluate", "--targets", targets, "--before", measured, "--max-mm", "0.1"});
  EXPECT_EQ(past.exit_code, 1);
  EXPECT_THAT(past.err, HasSubstr("limit: position"));
}

TEST_F(Verdicts, ACheckDistanceThatIsFarOffIsAProblem) {
  const std::string campaign = contents(lab_ / "campaign.yaml");
  write(lab_ / "campaign.yaml", campaign + "checks: [{a: 0, b: 5, length_mm: 50, sigma_mm: 0.05}]\n");
  (void)measure(observations_);
  const double length = quality()["checks"][0]["length_mm"];
  write(lab_ / "campaign.yaml",
        campaign + fmt::format("checks: [{{a: 0, b: 5, length_mm: {}, sigma_mm: 0.05}}]\n", length));
  EXPECT_EQ(measure(observations_).exit_code, 0);
  write(lab_ / "campaign.yaml",
        campaign + fmt::format("checks: [{{a: 0, b: 5, length_mm: {}, sigma_mm: 0.049}}]\n", length + 0.54));
  const CommandResult result = measure(observations_);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, ContainsRegex("problem: check 0-5: .* 11\\.0 sigma apart.*measure the distance"));
  EXPECT_THAT(poses()["p001"].status, HasSubstr("suspect: check 0-5"));
  EXPECT_TRUE(poses()["p001"].pose);
  const CommandResult reported = report();
  EXPECT_EQ(reported.exit_code, 1);
  EXPECT_THAT(reported.out, AllOf(HasSubstr("Not usable"), Not(HasSubstr(kSend))));
}

TEST_F(Verdicts, SlipsOfDatumAndScaleAreNamedAndNoPoseIsOk) {
  struct Slip {
    const char *file, *from, *to, *words, *status;
  };
  const char* scale = "scale: {from: markers, print_scale_sigma: 0}";
  for (const Slip& slip :
       {Slip{"markers_nominal.csv", "x_mm,y_mm,z_mm", "x_mm,z_mm,y_mm",
             "problem: UG: its nominal coordinates are mirrored: y and z are exchanged", "no_datum"},
        Slip{"campaign.yaml", "size_mm: 24", "size_mm: 0.024", "the markers' size_mm in m", "no_datum"},
        Slip{"campaign.yaml", "ids: [0-9]", "ids: [10-19]", "no fixed marker connects it", ""},
        Slip{"campaign.yaml", scale, "scale: {bars: [{a: 0.0, b: 0.1, length_mm: 23.7, sigma_mm: 0.01}]}",
             "UG's nominal coordinates are 1.26", "suspect"},
        Slip{"campaign.yaml", "{from: nominal, file: markers_nominal.csv}",
             "{from: features, z: {plane: [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]}, x: {line: [0, 4]}, origin: "
             "{point: 0}}",
             "markers lie on one plane within 0.5 mm", "no_datum"}}) {
    const std::string before = contents(lab_ / slip.file);
    write(lab_ / slip.file, replaced_all(before, slip.from, slip.to));
    const CommandResult result = measure(observations_);
    EXPECT_EQ(result.exit_code, 1) << slip.to << result.err;
    EXPECT_THAT(result.out, HasSubstr(slip.words));
    for (const char* id : {"p001", "p005"})
      EXPECT_THAT(poses()[id].status, HasSubstr(slip.status)) << slip.to;
    for (const auto& [id, pose] : poses()) EXPECT_TRUE(id == "home" || pose.status != "ok") << id << slip.to;
    write(lab_ / slip.file, before);
  }
}

TEST_F(Verdicts, ExchangedFoldersAreToBeExchangedAndNothingIsSent) {
  std::string observations = replaced_all(observations_, "p002/", "pXXX/");
  observations = replaced_all(replaced_all(observations, "p003/", "p002/"), "pXXX/", "p003/");
  const CommandResult result = measure(observations);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("exchange the two folders p002 and p003"));
  for (const char* id : {"p002", "p003"}) EXPECT_THAT(poses()[id].status, HasSubstr("suspect: swapped"));
  for (const char* id : {"p001", "p004", "p008"}) EXPECT_EQ(poses()[id].status, "ok");
  const CommandResult compensated = run_hexcal({"compensate", lab_.string()});
  EXPECT_EQ(compensated.exit_code, 1);
  EXPECT_THAT(compensated.out, HasSubstr("left out p002: suspect: swapped with p003?"));
  const CommandResult reported = report();
  EXPECT_EQ(reported.exit_code, 1);
  EXPECT_THAT(reported.out, AllOf(HasSubstr("Exchange the two folders p002 and p003."), Not(HasSubstr(kSend)),
                                  Not(HasSubstr("Photograph p002 again"))));
}

TEST_F(Verdicts, WithSevenPosesAgainstFortyEightNumbersNobodyIsAccused) {
  ASSERT_EQ(measure(observations_).exit_code, 0);
  const std::string table = contents(lab_ / "results/poses.csv");
  fs::remove(lab_ / "results/poses_covariance.csv");
  for (int left_out = 1; left_out <= 8; ++left_out) {
    std::string kept;
    std::istringstream lines(table);
    for (std::string line; std::getline(lines, line);) {
      if (!line.starts_with(fmt::format("p{:03d},", left_out))) kept += line + '\n';
    }
    write(lab_ / "results/poses.csv", kept);
    const CommandResult result = run_hexcal({"compensate", lab_.string(), "--json"});
    EXPECT_EQ(Json::parse(result.out)["unexplained"], Json::array()) << "without p00" << left_out;
  }
}

TEST_F(Verdicts, APhotographInTheFolderOfAnotherPoseIsNamedWithItsOwn) {
  const std::size_t at = observations_.find("p004/");
  std::string observations = observations_;
  observations.replace(at, 5, "p005/");
  const CommandResult result = measure(observations);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out,
              ContainsRegex("photograph p005/.* shows pose p004, not p005: move it to the folder of p004"));
  EXPECT_THAT(contents(lab_ / "results/photos.csv"), HasSubstr("suspect: it shows pose p004"));
}

TEST_F(Verdicts, TargetsTurnedByNinetyDegreesSayWhichFramesDisagree) {
  std::vector<PoseRecord> targets = read_pose_table(lab_ / "targets.csv");
  const Eigen::Quaterniond quarter(Eigen::AngleAxisd(90 * kRadPerDeg, Eigen::Vector3d::UnitZ()));
  for (PoseRecord& target : targets) {
    const Rigid3 motion = home_from_lg(*target.pose);
    target.pose =
        pose_from_home_from_lg({quarter * motion.rotation * quarter.inverse(), quarter * motion.translation});
  }
  write(lab_ / "targets.csv", format_pose_table("", targets, PoseColumns::target));
  const CommandResult result = measure(observations_);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, ContainsRegex("turned by 90 deg about .*the axes of frame UG in campaign.yaml"));
  const CommandResult reported = report();
  EXPECT_EQ(reported.exit_code, 1);
  EXPECT_THAT(reported.out,
              AllOf(HasSubstr("next: Find out which of the two is right"), Not(HasSubstr(kSend))));
}

TEST_F(Verdicts, AMisspeltTargetIsNamedWithThePoseThatIsMeant) {
  write(lab_ / "targets.csv", replaced_all(contents(lab_ / "targets.csv"), "p001,", "P001,"));
  EXPECT_THAT(measure(observations_).out, HasSubstr("did you mean p001?"));
  for (const fs::directory_entry& pose :
       fs::directory_iterator(fs::path(HEXCAL_SOURCE) / "samples/small_lab/poses")) {
    fs::create_directories(lab_ / "poses" / pose.path().filename());
    fs::copy(*fs::directory_iterator(pose), lab_ / "poses" / pose.path().filename());
  }
  const CommandResult check = run_hexcal({"check", lab_.string()});
  EXPECT_THAT(check.out, HasSubstr("target P001: has no photographs; did you mean p001?"));
  EXPECT_THAT(check.out, Not(HasSubstr("nothing wrong found")));
}

TEST_F(Verdicts, AHomeThatIsForgottenOrWrittenOtherwiseHasAWayOn) {
  const std::string homeless = without(observations_, "home/");
  const CommandResult refused = measure(homeless);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("--home POSE"));
  const CommandResult relative = measure(homeless, {"--home", "p001"});
  EXPECT_EQ(relative.exit_code, 1);
  EXPECT_THAT(relative.out, HasSubstr("the poses are relative to p001, not to the machine's home"));
  EXPECT_EQ(poses()["p001"].pose->vector().norm(), 0);
  EXPECT_EQ(poses()["p002"].status, "ok");
  const CommandResult other_case = measure(replaced_all(observations_, "home/", "Home/"));
  EXPECT_EQ(other_case.exit_code, 0) << other_case.out << other_case.err;
  EXPECT_THAT(other_case.out, HasSubstr("'home' is none of the poses; 'Home' was taken"));
}

TEST_F(Verdicts, WithOnePhotographLessTheAngleBetweenStationsIsStatedRightly) {
  for (const char* pose : {"p001", "p002", "p006"}) {
    (void)measure(without(observations_, std::string(pose) + "/", 2));
    for (const Json& row : quality()["poses"]) {
      if (row["pose"] != pose) continue;
      EXPECT_EQ(row["images"], 2) << pose;
      EXPECT_GT(row["intersection_deg"].get<double>(), 10) << pose;
      EXPECT_EQ(row["words"].get<std::string>().find("nearly one direction"), std::string::npos) << pose;
    }
  }
}

TEST_F(Verdicts, AMissingHexapodFileIsSaidAndTheReportIsWrittenAnyway) {
  for (const char* pose : {"home", "p001"}) {
    fs::copy(fs::path(HEXCAL_SOURCE) / "samples/small_lab/poses" / pose, lab_ / "poses" / pose,
             fs::copy_options::recursive);
  }
  fs::remove(lab_ / "hexapod.yaml");
  const CommandResult result = run_hexcal({"run", lab_.string()});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_THAT(result.out, ContainsRegex("not compensated: .*hexapod.yaml"));
  EXPECT_TRUE(fs::exists(lab_ / "results/report.html"));
}

}  // namespace
}  // namespace hexcal
