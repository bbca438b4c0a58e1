#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/report/sample_report.h"
#include "tests/report/well_formed.h"
#include "tools/report/comparison_page.h"

namespace hexcal {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// The second round of a machine whose errors fell to a share of what they were.
ComparisonReport two_rounds(double left) {
  ComparisonReport report{sample_report(), sample_report()};
  report.after.name = "round 2";
  report.after.compensation.reset();
  for (std::size_t i = 0; i < report.after.poses.size(); ++i) {
    PoseRecord& record = report.after.poses[i];
    if (!record.pose) continue;
    const Vector6d target = report.after.targets[i].pose->vector();
    record.pose = Pose::from_vector(target + left * (record.pose->vector() - target));
  }
  return report;
}

TEST(Comparison, AFallOfTheErrorIsSaidInNumbers) {
  const Verdict verdict = comparison_verdict(two_rounds(0.01));
  EXPECT_EQ(verdict.light, Light::good);
  EXPECT_THAT(verdict.headline, HasSubstr("(99.0"));
  EXPECT_THAT(verdict.headline, HasSubstr("9 poses"));
  EXPECT_THAT(verdict.findings, Contains(HasSubstr("promised")));
}

TEST(Comparison, AMachineThatBecameWorseIsNotUsable) {
  const Verdict verdict = comparison_verdict(two_rounds(1.5));
  EXPECT_EQ(verdict.light, Light::bad);
  EXPECT_THAT(verdict.next_steps, Contains(HasSubstr("actuators.csv")));
}

TEST(Comparison, RoundsWithoutACommonPoseAreNotCompared) {
  ComparisonReport report = two_rounds(0.5);
  for (PoseRecord& record : report.after.poses) record.id += " again";
  EXPECT_EQ(comparison_verdict(report).light, Light::bad);
  EXPECT_THAT(comparison_verdict(report).headline, HasSubstr("share no measured pose"));
  EXPECT_TRUE(comparison_charts(report).empty());
  EXPECT_THAT(render_page(comparison_page(report)), HasSubstr("The two measurements"));
}

TEST(Comparison, ThePageHoldsTheTablesAndEveryFigureIsWellFormed) {
  const ComparisonReport report = two_rounds(0.01);
  const std::string page = render_page(comparison_page(report));
  for (const char* id : {"verdict", "errors", "figures", "measurement", "provenance"})
    EXPECT_THAT(page, HasSubstr(std::string("id=\"") + id + '"'));
  EXPECT_THAT(page, HasSubstr("Error of each pose before and after"));
  EXPECT_FALSE(comparison_charts(report).empty());
  for (const Chart& chart : comparison_charts(report))
    EXPECT_THAT(chart_svg_file(chart), IsWellFormedXml()) << chart.id;
}

TEST(Comparison, APoseThatBecameWorseIsNamedThoughTheRestImproved) {
  ComparisonReport report = two_rounds(0.01);
  report.after.poses[0].pose = two_rounds(1.5).after.poses[0].pose;
  const Verdict verdict = comparison_verdict(report);
  EXPECT_EQ(verdict.light, Light::warning);
  EXPECT_THAT(verdict.findings,
              Contains("1 of 9 poses became worse, beyond the measurement's noise: pose_1."));
}

TEST(Comparison, ErrorsAsSmallAsTheNoiseNeedNoMoreCompensation) {
  const std::string words =
      "What remains is about the noise of the measurement itself: there is nothing left";
  EXPECT_THAT(comparison_verdict(two_rounds(0.0001)).findings, Contains(HasSubstr(words)));
  EXPECT_THAT(comparison_verdict(two_rounds(0.1)).findings, Not(Contains(HasSubstr(words))));
}

TEST(Comparison, ARoundThatWasNotMeasuredIsNamed) {
  ComparisonReport report = two_rounds(0.5);
  report.after.poses.clear();
  const Verdict verdict = comparison_verdict(report);
  EXPECT_EQ(verdict.light, Light::bad);
  EXPECT_EQ(verdict.headline, "Nothing has been measured in round 2 yet.");
  EXPECT_THAT(verdict.next_steps, ElementsAre("Run `hexcal measure` on round 2."));
}

}  // namespace
}  // namespace hexcal
