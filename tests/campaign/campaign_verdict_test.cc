#include "tools/campaign/campaign_verdict.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <functional>

#include "tests/report/sample_report.h"
#include "tools/io/number_text.h"

namespace hexcal {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

MATCHER_P(Says, words, "") { return finding_text(arg).find(words) != std::string::npos; }

// The report's sample without what is wrong with it: a failed pose and a weak one.
struct Results {
  Results() {
    const CampaignReport& sample = sample_report();
    evidence.poses = sample.poses;
    evidence.poses[2] = evidence.poses[3];
    evidence.poses[2].id = "pose_3";
    evidence.poses[5].remarks.clear();
    calibration = sample.compensation->calibration;
    evidence.calibration = &calibration;
  }
  CrossValidation& method(const std::string& name) {
    return *std::ranges::find(calibration.comparison.methods, name, &CrossValidation::name);
  }
  CalibrationReport calibration;
  CampaignEvidence evidence;
};

TEST(CampaignVerdict, AGoodCampaignIsSentWithItsGainOverTheSamePoses) {
  Results results;
  const CampaignVerdict verdict = judge_results(results.evidence);
  EXPECT_EQ(verdict.severity, Severity::good);
  EXPECT_TRUE(verdict.send);
  EXPECT_THAT(verdict.headline, HasSubstr("Compensation by option3"));
  EXPECT_THAT(verdict.headline,
              HasSubstr(significant_text(results.method("none").errors.position_rms_mm, 3)));
  EXPECT_THAT(verdict.next_steps, Contains(HasSubstr("send `results/actuators.csv`")));
}

TEST(CampaignVerdict, NothingMeasuredIsSaid) {
  const CampaignVerdict verdict = judge_results({});
  EXPECT_EQ(verdict.severity, Severity::bad);
  EXPECT_THAT(verdict.next_steps, Contains(HasSubstr("hexcal measure")));
}

struct Fault {
  const char* name;
  std::function<void(Results&)> play;
  Severity severity;
  bool send;
  std::vector<std::string> findings, next_steps;
};

class CampaignFault : public ::testing::TestWithParam<Fault> {};

TEST_P(CampaignFault, IsJudgedWithCauseAndInstruction) {
  Results results;
  GetParam().play(results);
  const CampaignVerdict verdict = judge_results(results.evidence);
  EXPECT_EQ(verdict.severity, GetParam().severity);
  EXPECT_EQ(verdict.send, GetParam().send);
  const bool told_to_send =
      ::testing::Matches(Contains(HasSubstr("send `results/actuators.csv`")))(verdict.next_steps);
  EXPECT_EQ(told_to_send, GetParam().send);
  for (const std::string& words : GetParam().findings) {
    EXPECT_THAT(verdict.findings, Contains(Says(words)));
    EXPECT_THAT(judge_results(Results().evidence).findings, Not(Contains(Says(words))));
  }
  for (const std::string& words : GetParam().next_steps)
    EXPECT_THAT(verdict.next_steps, Contains(HasSubstr(words)));
}

INSTANTIATE_TEST_SUITE_P(
    Verdict, CampaignFault,
    ::testing::Values(
        Fault{"swapped_folders",
              [](Results& r) {
                r.evidence.poses[0].status = "suspect: swapped with pose_2?";
                r.evidence.poses[1].status = "suspect: swapped with pose_1?";
                r.evidence.quality.emplace();
                r.evidence.quality->findings.emplace_back("pose_1 and pose_2 look swapped",
                                                          "exchange the two folders pose_1 and pose_2",
                                                          Severity::bad);
              },
              Severity::bad,
              false,
              {"pose_1 and pose_2 look swapped", "2 poses measured, but something contradicts them"},
              {"exchange the two folders pose_1 and pose_2"}},
        Fault{"a_warning_lets_send",
              [](Results& r) {
                r.evidence.quality.emplace();
                r.evidence.quality->findings.emplace_back("marker 103 stands elsewhere",
                                                          "look whether it sticks");
              },
              Severity::warning,
              true,
              {"marker 103 stands elsewhere"},
              {"look whether it sticks", "send `results/actuators.csv`"}},
        Fault{"a_pose_failed",
              [](Results& r) {
                r.evidence.poses[2].pose.reset();
                r.evidence.poses[2].status = "no_markers: dark";
              },
              Severity::warning,
              true,
              {"1 of 10 poses could not be measured: pose_3"},
              {"take the photographs of pose_3 again"}},
        Fault{"no_better",
              [](Results& r) { r.method("option3").errors.position_rms_mm = 1e3; },
              Severity::bad,
              false,
              {"no method makes this machine better"},
              {"do not use the corrected commands"}},
        Fault{"nothing_chosen",
              [](Results& r) { r.calibration.chosen = "none"; },
              Severity::bad,
              false,
              {"no method makes this machine better"},
              {}},
        Fault{"noise",
              [](Results& r) { r.method("option3").errors.position_rms_mm = 0.006; },
              Severity::good,
              true,
              {"what remains is about the noise of the measurement itself"},
              {}},
        Fault{"left_out",
              [](Results& r) {
                r.calibration.outliers = {"pose_2"};
                r.calibration.unexplained = {"pose_4", "pose_7"};
              },
              Severity::warning,
              true,
              {"left out as near singular: pose_2", "no model explains pose_4 and pose_7: measured"},
              {"photograph pose_4 and pose_7 again"}},
        Fault{"out_of_reach",
              [](Results& r) {
                r.evidence.commands = {{"pose_1", "ok", {}}, {"pose_8", "out_of_stroke", {}}};
              },
              Severity::warning,
              true,
              {"1 pose cannot be reached after compensation: pose_8"},
              {}},
        Fault{"single",
              [](Results& r) { r.evidence.poses[0].remarks = "one photograph only"; },
              Severity::warning,
              true,
              {"pose_1 (one photograph only)"},
              {}}),
    [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace hexcal
