#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "tests/report/sample_report.h"
#include "tests/report/well_formed.h"
#include "tools/report/campaign_report.h"

namespace hexcal {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

TEST(CampaignReport, JudgesEachPoseWithWords) {
  const std::vector<PoseJudgement> judgements = judge_poses(sample_report().poses);
  EXPECT_EQ(judgements[0].light, Light::good);
  EXPECT_THAT(judgements[0].words, IsEmpty());
  EXPECT_EQ(judgements[2].light, Light::bad);
  EXPECT_EQ(judgements[2].words, "no <markers> & no light");
  EXPECT_EQ(judgements[5].light, Light::warning);
  EXPECT_THAT(judgements[5].words, HasSubstr("sigma"));
}

TEST(CampaignReport, ASuspectPoseIsRedAndCountsInNoStatistic) {
  CampaignReport report = sample_report();
  report.poses[0].status = "suspect: swapped with pose_2?";
  EXPECT_EQ(judge_poses(report.poses)[0].light, Light::bad);
  EXPECT_THAT(judge_poses(report.poses)[0].words, HasSubstr("swapped with pose_2"));
  EXPECT_EQ(campaign_verdict(report).light, Light::bad);
  EXPECT_THAT(campaign_verdict(report).findings, ::testing::Contains(HasSubstr("swapped with pose_2")));
  EXPECT_FALSE(paper_data(report).before.pairs[0].has_value());
}

TEST(CampaignReport, VerdictNamesTheFailedPoseAndTheNextStep) {
  const Verdict verdict = campaign_verdict(sample_report());
  EXPECT_THAT(verdict.findings, ::testing::Contains(HasSubstr("pose_3")));
  EXPECT_THAT(verdict.next_steps, ::testing::Contains(HasSubstr("Retake")));
  EXPECT_THAT(verdict.headline, HasSubstr("option3"));
}

TEST(CampaignReport, NothingMeasuredIsSaidAndNotDrawn) {
  CampaignReport report;
  report.name = "empty";
  EXPECT_EQ(campaign_verdict(report).light, Light::bad);
  EXPECT_THAT(campaign_verdict(report).next_steps, ::testing::Contains(HasSubstr("hexcal measure")));
  EXPECT_THAT(render_page(campaign_page(report)), Not(HasSubstr("<table")));
  EXPECT_THAT(campaign_charts(report), IsEmpty());
}

TEST(CampaignReport, PageEscapesTheUsersTextAndHoldsEverySection) {
  const std::string page = render_page(campaign_page(sample_report()));
  EXPECT_THAT(page, Not(AnyOf(HasSubstr("<markers>"), HasSubstr("<Tiger>"))));
  for (const char* id : {"verdict", "poses", "methods", "machine", "provenance", "figure_09_absolute_errors",
                         "figure_10_ranges_before", "ranges_option1", "deviations_option3",
                         "figure_17_improvement", "figure_18_all_ranges"}) {
    EXPECT_THAT(page, HasSubstr(std::string("id=\"") + id + '"'));
  }
  EXPECT_EQ(page, render_page(campaign_page(sample_report())));
}

TEST(CampaignReport, EveryFigureIsWellFormed) {
  for (const Chart& chart : campaign_charts(sample_report())) {
    EXPECT_THAT(chart_svg_file(chart), IsWellFormedXml()) << chart.id;
    EXPECT_THAT(chart_svg_file(chart), Not(HasSubstr("nan"))) << chart.id;
  }
}

TEST(CampaignReport, APoseThatDefinesTheFrameIsNotJudged) {
  std::vector<PoseRecord> poses = sample_report().poses;
  poses[0].sigma->setZero();
  EXPECT_EQ(judge_poses(poses)[0].light, Light::none);
  EXPECT_THAT(judge_poses(poses)[0].words, HasSubstr("defines"));
}

TEST(CampaignReport, FiguresOfTheirOwnAreForThePapersOptionsAndTheChosenMethod) {
  const PaperData data = paper_data(sample_report());
  int with_figures = 0;
  for (const MethodPoses& method : data.methods) {
    EXPECT_NE(method.name, "none");
    with_figures += method.has_figures ? 1 : 0;
  }
  EXPECT_GE(with_figures, 3);
  EXPECT_LE(with_figures, 4);
}

TEST(CampaignReport, TheNetworkShowsItsPhotographsAndWhatIsWrongWithThem) {
  const std::string page = render_page(campaign_page(sample_report()));
  EXPECT_THAT(page, HasSubstr("id=\"residual_vectors\""));
  EXPECT_THAT(page, HasSubstr("marker 103: contradicts the rest"));
  EXPECT_THAT(page, HasSubstr("Photographs that need a look"));
  EXPECT_THAT(page, HasSubstr("no markers: the room was dark"));
  EXPECT_THAT(page, HasSubstr("data:image/jpeg;base64,/9j/"));
  const Verdict verdict = campaign_verdict(sample_report());
  EXPECT_THAT(verdict.findings, ::testing::Contains("Marker 103 moved."));
}

TEST(CampaignReport, ALargeCampaignStaysSmall) {
  CampaignReport report = sample_report();
  const PhotographPart photograph = report.network->photographs[0];
  // 400 photographs of 40 markers each, without their pictures.
  PhotographPart crowded = photograph;
  crowded.thumbnail_jpeg.clear();
  while (crowded.outlines.size() < 40) {
    crowded.outlines.push_back(photograph.outlines[0]);
    crowded.residuals.insert(crowded.residuals.end(), photograph.residuals.begin(),
                             photograph.residuals.begin() + 4);
  }
  report.network->photographs.assign(400, crowded);
  EXPECT_LT(render_page(campaign_page(report)).size(), 5'000'000U);
}

struct FaultyCampaign {
  const char* name;
  std::function<void(CampaignReport&)> change;
  Light least;  ///< of the verdict
  std::vector<std::string> findings, next_steps;
};

class CampaignFault : public ::testing::TestWithParam<FaultyCampaign> {};

TEST_P(CampaignFault, IsSaidWithWhatToDo) {
  CampaignReport report = sample_report();
  GetParam().change(report);
  const Verdict verdict = campaign_verdict(report);
  EXPECT_GE(verdict.light, GetParam().least);
  for (const std::string& words : GetParam().findings) {
    EXPECT_THAT(verdict.findings, ::testing::Contains(HasSubstr(words)));
    EXPECT_THAT(campaign_verdict(sample_report()).findings, Not(::testing::Contains(HasSubstr(words))));
  }
  for (const std::string& words : GetParam().next_steps)
    EXPECT_THAT(verdict.next_steps, ::testing::Contains(words));
}

CrossValidation& chosen_of(CampaignReport& report) {
  CalibrationReport& calibration = report.compensation->calibration;
  return *std::ranges::find(calibration.comparison.methods, calibration.chosen, &CrossValidation::name);
}

INSTANTIATE_TEST_SUITE_P(
    Verdict, CampaignFault,
    ::testing::Values(
        FaultyCampaign{"residuals",
                       [](CampaignReport& r) { r.network->sigma0 = 3; },
                       Light::warning,
                       {"Residuals are 3.0 times what the corners' own standard deviations promise (sigma0)"},
                       {}},
        FaultyCampaign{"no_better",
                       [](CampaignReport& r) { chosen_of(r).errors.position_rms_mm = 1e3; },
                       Light::bad,
                       {"No method makes this machine better: do not use the commands."},
                       {}},
        FaultyCampaign{
            "noise",
            [](CampaignReport& r) { chosen_of(r).errors.position_rms_mm = 0.006; },
            Light::warning,
            {"What remains is about the noise of the measurement itself: the machine may be better"},
            {}},
        FaultyCampaign{
            "left_out",
            [](CampaignReport& r) {
              r.compensation->calibration.outliers = {"pose_2"};
              r.compensation->calibration.unexplained = {"pose_4", "pose_7"};
            },
            Light::warning,
            {"Left out as near singular: pose_2.", "No model explains pose_4 and pose_7: measured"},
            {"Photograph pose_4 and pose_7 again."}},
        FaultyCampaign{"out_of_reach",
                       [](CampaignReport& r) {
                         r.commands = {{"pose_1", "ok", {}}, {"pose_8", "out_of_stroke", {}}};
                       },
                       Light::warning,
                       {"1 pose cannot be reached after compensation: pose_8."},
                       {}},
        FaultyCampaign{"single",
                       [](CampaignReport& r) { r.poses[0].images = 1; },
                       Light::warning,
                       {"pose_1 (a single photograph: nothing checks it)"},
                       {}}),
    [](const auto& one) { return one.param.name; });

TEST(CampaignReport, PosesWithoutTargetsAskForThem) {
  CampaignReport report = sample_report();
  report.targets.clear();
  EXPECT_THAT(render_page(campaign_page(report)),
              HasSubstr("No pose has a target: name <code>targets</code> in campaign.yaml to see errors."));
}

TEST(CampaignReport, APhotographWithLargeResidualsNeedsALook) {
  CampaignReport report = sample_report();
  std::vector<PhotographPart>& photographs = report.network->photographs;
  const PhotographPart clean = photographs[2];
  const std::string words = "residuals more than 3 times the campaign";
  photographs.insert(photographs.end(), 3, clean);
  EXPECT_THAT(render_page(campaign_page(report)), Not(HasSubstr(words)));
  photographs.back().rms_px *= 4;
  EXPECT_THAT(render_page(campaign_page(report)), HasSubstr(words));
}

}  // namespace
}  // namespace hexcal
