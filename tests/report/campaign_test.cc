#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/report/sample_campaign.h"
#include "tests/report/well_formed.h"
#include "tools/report/campaign_report.h"

namespace hexcal {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

const CampaignReport& sample_report() {
  static const CampaignReport report = [] {
    SampleCampaign campaign = sample_campaign(10);
    campaign.measured[2].pose.reset();
    campaign.measured[2].sigma.reset();
    campaign.measured[2].status = "no <markers> & no light";
    *campaign.measured[5].sigma *= 5;
    CampaignReport out;
    out.name = "<Tiger> & Co";
    out.poses = campaign.measured;
    out.targets = campaign.targets;
    CompensationPart part;
    part.nominal = sample_hexapod();
    for (std::size_t i = 0; i < campaign.measured.size(); ++i) {
      if (!campaign.measured[i].pose) continue;
      PoseObservation observation;
      observation.id = campaign.targets[i].id;
      observation.target = campaign.targets[i].pose;
      observation.measured = *campaign.measured[i].pose;
      observation.covariance = campaign.measured[i].sigma->cwiseAbs2().asDiagonal();
      observation.readings = readings_from_lengths(
          part.nominal, leg_lengths(part.nominal, part.nominal.B_from_P(*observation.target)));
      part.observations.poses.push_back(observation);
    }
    CalibrateOptions options;
    options.method = "option3";
    options.comparison.leave_one_out_up_to = 0;
    options.comparison.folds = 2;
    part.calibration = calibrate(part.nominal, part.observations, options);
    out.compensation = part;
    out.provenance = {{"program", "hexcal"}};
    return out;
  }();
  return report;
}

TEST(CampaignReport, JudgesEachPoseWithWords) {
  const std::vector<PoseJudgement> judgements = judge_poses(sample_report().poses);
  EXPECT_EQ(judgements[0].light, Light::good);
  EXPECT_THAT(judgements[0].words, IsEmpty());
  EXPECT_EQ(judgements[2].light, Light::bad);
  EXPECT_EQ(judgements[2].words, "no <markers> & no light");
  EXPECT_EQ(judgements[5].light, Light::warning);
  EXPECT_THAT(judgements[5].words, HasSubstr("sigma"));
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

TEST(CampaignReport, ASecondRoundStandsBesideTheFirst) {
  CampaignReport report = sample_report();
  report.second_round_name = "round 2";
  report.second_round = report.targets;  // a machine without errors
  EXPECT_THAT(campaign_verdict(report).findings[0], HasSubstr("round 2"));
  const PaperData data = paper_data(report);
  EXPECT_EQ(data.methods.back().name, "round 2");
  EXPECT_THAT(render_page(campaign_page(report)), HasSubstr("measured again"));
}

}  // namespace
}  // namespace hexcal
