#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/report/sample_report.h"
#include "tests/report/well_formed.h"
#include "tools/report/campaign_report.h"

namespace hexcal {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

TEST(CampaignReport, ShowsEachPosesVerdictWithItsWords) {
  const std::vector<PoseRecord> poses = sample_report().poses;
  EXPECT_EQ(pose_light(poses[0]).light, Light::good);
  EXPECT_THAT(pose_light(poses[0]).words, IsEmpty());
  EXPECT_EQ(pose_light(poses[2]).light, Light::bad);
  EXPECT_EQ(pose_light(poses[2]).words, "no <markers> & no light");
  EXPECT_EQ(pose_light(poses[5]).light, Light::warning);
  EXPECT_THAT(pose_light(poses[5]).words, HasSubstr("sigma"));
}

TEST(CampaignReport, ASuspectPoseIsRedAndCountsInNoStatistic) {
  CampaignReport report = sample_report();
  report.poses[0].status = "suspect: swapped with pose_2?";
  EXPECT_EQ(pose_light(report.poses[0]).light, Light::bad);
  EXPECT_THAT(pose_light(report.poses[0]).words, HasSubstr("swapped with pose_2"));
  EXPECT_FALSE(paper_data(report).before.pairs[0].has_value());
}

TEST(CampaignReport, WhatNoMethodIsJudgedOnIsNoPartOfBefore) {
  CampaignReport report = sample_report();
  ASSERT_TRUE(paper_data(report).before.pairs[1].has_value());
  report.compensation->calibration.unexplained = {report.poses[0].id};
  report.compensation->calibration.outliers = {report.poses[1].id};
  report.poses[3].pose = Pose{};
  report.poses[3].sigma->setZero();
  for (const std::size_t i : {0U, 1U, 3U}) EXPECT_FALSE(paper_data(report).before.pairs[i].has_value()) << i;
  EXPECT_TRUE(paper_data(report).before.pairs[4].has_value());
}

TEST(CampaignReport, TheVerdictIsShownFirst) {
  const std::string page = render_page(campaign_page(sample_report()));
  EXPECT_THAT(page, HasSubstr("Nearly all went well."));
  EXPECT_LT(page.find("Marker 103 moved."), page.find("id=\"poses\""));
}

TEST(CampaignReport, NothingMeasuredIsNotDrawn) {
  CampaignReport report;
  report.name = "empty";
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
  EXPECT_EQ(pose_light(poses[0]).light, Light::none);
  EXPECT_THAT(pose_light(poses[0]).words, HasSubstr("defines"));
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

TEST(CampaignReport, PosesWithoutTargetsAskForThem) {
  CampaignReport report = sample_report();
  report.targets.clear();
  EXPECT_THAT(render_page(campaign_page(report)),
              HasSubstr("No pose has a target: name <code>targets</code> in campaign.yaml to see errors."));
}

TEST(CampaignReport, APhotographWithARemarkNeedsALook) {
  CampaignReport report = sample_report();
  const std::string words = "residuals 4 times the campaign";
  EXPECT_THAT(render_page(campaign_page(report)), Not(HasSubstr(words)));
  report.network->photographs[2].remarks = words;
  EXPECT_THAT(render_page(campaign_page(report)), HasSubstr(words));
}

}  // namespace
}  // namespace hexcal
