#include <gmock/gmock.h>

#include <regex>
#include <set>

#include "tests/support/json_schema.h"
#include "tests/support/run_hexcal.h"
#include "tests/support/sample_campaign.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

const fs::path kSchemas = fs::path(HEXCAL_SOURCE) / "tools" / "hexcal" / "schema";

class JsonOutput : public ::testing::Test {
 protected:
  [[nodiscard]] std::string at(const char* file) const { return (lab_ / file).string(); }

  // The command's standard output is one JSON document as its schema says.
  static nlohmann::json expect_schema(const std::vector<std::string>& arguments) {
    std::vector<std::string> with_json = arguments;
    with_json.emplace_back("--json");
    const CommandResult result = run_hexcal(with_json);
    EXPECT_LE(result.exit_code, 1) << result.err;
    auto json = nlohmann::json::parse(result.out, nullptr, false);
    EXPECT_FALSE(json.is_discarded()) << arguments[0] << ": no JSON: " << result.out.substr(0, 200);
    if (json.is_discarded()) return json;
    EXPECT_EQ(JsonSchema(kSchemas / (arguments[0] + ".json")).fault(json), "") << arguments[0];
    return json;
  }

  TemporaryFolder folder_;
  fs::path lab_ = folder_.path() / "lab";
};

// One test: each would measure the campaign anew.
TEST_F(JsonOutput, OfACampaignIsAsTheSchemasSay) {
  copy_sample_campaign(lab_, {"home", "p001", "p002", "p003", "p004"});
  const auto run = expect_schema({"run", lab_.string()});
  for (const char* stage : {"measure", "compensate", "report"}) EXPECT_TRUE(run.contains(stage)) << stage;
  expect_schema({"measure", lab_.string(), "--dry-run"});
  expect_schema({"check", lab_.string()});
  expect_schema({"detect", at("poses/home/DSC_0001.jpg"), "-o", (folder_.path() / "seen.txt").string()});
  expect_schema({"evaluate", "--targets", at("targets.csv"), "--before", at("results/poses.csv"), "--after",
                 at("results/poses.csv")});
  expect_schema({"plan", lab_.string(), "-n", "6", "-o", (folder_.path() / "plan.csv").string()});
}

TEST_F(JsonOutput, OfACalibrationIsAsTheSchemaSays) {
  copy_sample_campaign(lab_);
  expect_schema({"camera", "--compare", at("camera.yaml"), at("camera.yaml")});
  const fs::path photographs = fs::path(HEXCAL_SOURCE) / "samples" / "small_lab" / "calibration";
  expect_schema({"camera", (photographs / "DSC_0028.jpg").string(), (photographs / "DSC_0029.jpg").string(),
                 (photographs / "DSC_0030.jpg").string(), "--template", at("sheet.yaml"), "-o",
                 (folder_.path() / "camera.yaml").string()});
}

// Every command that offers --json has its schema, and the other way round.
TEST_F(JsonOutput, EveryCommandHasItsSchema) {
  std::set<std::string> offered, described;
  const std::string manual = run_hexcal({"completion", "fish"}).out;
  const std::regex line("__fish_seen_subcommand_from ([a-z]+)[^\n]*-l json");
  for (std::sregex_iterator it(manual.begin(), manual.end(), line), end; it != end; ++it)
    offered.insert((*it)[1]);
  for (const fs::directory_entry& entry : fs::directory_iterator(kSchemas))
    described.insert(entry.path().stem().string());
  EXPECT_EQ(offered, described);
}

TEST(JsonSchema, RefusesWhatASchemaDoesNotSay) {
  nlohmann::json json{{"verdict", "good"},
                      {"headline", "Fine."},
                      {"findings", nlohmann::json::array()},
                      {"next_steps", nlohmann::json::array()},
                      {"page", "report.html"},
                      {"figures", nlohmann::json::array()}};
  const JsonSchema schema(kSchemas / "report.json");
  EXPECT_EQ(schema.fault(json), "");
  json["more"] = 1;
  EXPECT_EQ(schema.fault(json), "$.more: not in the schema");
  json.erase("more");
  json["findings"] = "none";
  EXPECT_THAT(schema.fault(json), ::testing::HasSubstr("$.findings: found \"none\", wanted"));
  json.erase("findings");
  EXPECT_EQ(schema.fault(json), "$: findings is missing");
}

class Words : public JsonOutput {
 protected:
  void SetUp() override { copy_sample_campaign(lab_, {"home"}); }
};

TEST_F(Words, QuietPrintsNothingButErrorsAndJson) {
  const CommandResult result = run_hexcal({"measure", lab_.string(), "--quiet"});
  EXPECT_EQ(result.out + result.err, "");
  EXPECT_TRUE(fs::exists(lab_ / "results" / "poses.csv"));
  const CommandResult wrong = run_hexcal({"--quiet", "report", at("none")});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_NE(wrong.err, "");
  EXPECT_NE(run_hexcal({"check", lab_.string(), "--json", "--quiet"}).out, "");
}

TEST_F(Words, NameTheNextCommandAndHaveNoColoursInAPipe) {
  const CommandResult result = run_hexcal({"measure", lab_.string()});
  EXPECT_THAT(result.out, ::testing::EndsWith("next: hexcal compensate " + lab_.string() + "\n"));
  EXPECT_EQ(result.out.find('\x1b'), std::string::npos);
}

}  // namespace
}  // namespace hexcal
