#include <fmt/format.h>
#include <gmock/gmock.h>

#include <functional>

#include "pose_extract/extract_poses.h"
#include "pose_extract/pose_verdict.h"
#include "tests/support/campaign_scene.h"

namespace hexcal {
namespace {

using ::testing::HasSubstr;

// What a scale is from and what contradicts it, on a print that is `print_scale` larger than drawn.
struct ScaleSlip {
  const char* name;
  double print_scale;
  std::function<void(CampaignScene&)> slip;
  PoseStatus status;
  const char* words;
};

double true_distance(const CampaignScene& made, std::size_t a, std::size_t b) {
  return (made.scene.body_from_marker[a].translation - made.scene.body_from_marker[b].translation).norm();
}

KnownLength bar_of(const CampaignScene& made, int a, int b, double times = 1) {
  return {{a, -1},
          {b, -1},
          times * true_distance(made, static_cast<std::size_t>(a), static_cast<std::size_t>(b)),
          0.01};
}

void scale_sizes(CampaignScene& made, double times) {
  for (MarkerSizes* sizes : {&made.campaign.fixed, &made.campaign.moving})
    for (auto& [id, size] : *sizes) size *= times;
}

void take_bars(CampaignScene& made, std::vector<KnownLength> bars) {
  made.campaign.scale = ScaleFrom::bars;
  made.campaign.bars = std::move(bars);
}

// UG without coordinates, so that lengths alone speak of the scale.
void without_nominal(CampaignScene& made) { made.campaign.ug->from = FrameRule::From::markers; }

class ScaleSlips : public ::testing::TestWithParam<ScaleSlip> {};

TEST_P(ScaleSlips, MakePosesSuspectAndAreNamed) {
  const ScaleSlip& test = GetParam();
  ObservationSceneOptions options;
  options.num_epochs = 4;
  options.noise_px = 0.01;
  options.print_scale = test.print_scale;
  options.seed = 3;
  CampaignScene made = make_campaign_scene(options);
  made.campaign.print_scale_sigma = kPaperScaleSigma;
  test.slip(made);
  const CampaignResult result = extract_poses(made.campaign, made.observations);
  const std::string all = findings_text(result);
  EXPECT_THAT(all, HasSubstr(test.words));
  for (std::size_t e = 1; e < result.poses.size(); ++e) {
    const MeasuredPose& pose = result.poses[e];
    const bool failed = test.status == PoseStatus::disconnected && !is_measured(pose.status);
    EXPECT_TRUE(failed || pose.status == test.status)
        << pose_status_name(pose.status) << ": " << pose.words << "\n"
        << all;
    if (pose.status != PoseStatus::ok || made.campaign.ug->from != FrameRule::From::nominal) continue;
    const Vector6d z =
        pose_error(*pose.pose, true_pose(made, e)).cwiseQuotient(pose.covariance.diagonal().cwiseSqrt());
    EXPECT_LT(z.cwiseAbs().maxCoeff(), 4) << z.transpose();
  }
  EXPECT_EQ(overall_verdict(result) == Severity::bad, test.status != PoseStatus::ok) << all;
}

INSTANTIATE_TEST_SUITE_P(
    Scale, ScaleSlips,
    ::testing::Values(ScaleSlip{"PaperThatNobodyMeasured", 0.001, [](CampaignScene&) {}, PoseStatus::ok, ""},
                      ScaleSlip{"PrintThreePercentOffBesideCoordinates", 0.03, [](CampaignScene&) {},
                                PoseStatus::suspect, "% larger than measured"},
                      ScaleSlip{"PrintThreePercentOffBesideACheckDistance", 0.03,
                                [](CampaignScene& made) {
                                  without_nominal(made);
                                  made.campaign.checks.push_back(bar_of(made, 0, 4));
                                },
                                PoseStatus::suspect, "check 0-4: measured"},
                      ScaleSlip{"PrintThreePercentOffBesideABar", 0.03,
                                [](CampaignScene& made) {
                                  without_nominal(made);
                                  made.campaign.bars.push_back(bar_of(made, 0, 4));
                                },
                                PoseStatus::suspect, "bar 0-4: measured"},
                      ScaleSlip{"PrintThreePercentOffAndOneBarAlone", 0.03,
                                [](CampaignScene& made) {
                                  without_nominal(made);
                                  take_bars(made, {bar_of(made, 0, 4)});
                                },
                                PoseStatus::suspect, "nothing confirms it"},
                      ScaleSlip{"PrintThreePercentOffAndTwoBarsThatAgree", 0.03,
                                [](CampaignScene& made) {
                                  take_bars(made, {bar_of(made, 0, 4), bar_of(made, 5, 9)});
                                },
                                PoseStatus::ok, "the markers are printed "},
                      ScaleSlip{"PrintThreePercentOffAndABarWithCoordinates", 0.03,
                                [](CampaignScene& made) { take_bars(made, {bar_of(made, 0, 4)}); },
                                PoseStatus::ok, "the markers are printed "},
                      ScaleSlip{"ABarMistypedByOnePercent", 0,
                                [](CampaignScene& made) {
                                  without_nominal(made);
                                  take_bars(made, {bar_of(made, 0, 4, 1.01)});
                                },
                                PoseStatus::suspect, "nothing confirms it"},
                      ScaleSlip{"ABarMistypedBesideCoordinates", 0,
                                [](CampaignScene& made) { take_bars(made, {bar_of(made, 0, 4, 1.05)}); },
                                PoseStatus::suspect, "disagree with the scale used"},
                      ScaleSlip{"OneOfTwoBarsMistyped", 0,
                                [](CampaignScene& made) {
                                  without_nominal(made);
                                  take_bars(made, {bar_of(made, 0, 4), bar_of(made, 5, 9, 1.02)});
                                },
                                PoseStatus::suspect, "bar "},
                      ScaleSlip{"ABarInInch", 0,
                                [](CampaignScene& made) {
                                  without_nominal(made);
                                  take_bars(made, {bar_of(made, 0, 4, 1 / 25.4)});
                                },
                                PoseStatus::suspect, "(a factor of 25.4: inch for mm?)"},
                      ScaleSlip{"ACheckDistanceInM", 0,
                                [](CampaignScene& made) {
                                  without_nominal(made);
                                  made.campaign.checks.push_back(bar_of(made, 0, 4, 0.001));
                                },
                                PoseStatus::suspect, "(a factor of 1000: m for mm?)"},
                      ScaleSlip{"SizesInMBesideABar", 0,
                                [](CampaignScene& made) {
                                  without_nominal(made);
                                  scale_sizes(made, 0.001);
                                  made.campaign.bars.push_back(bar_of(made, 0, 4));
                                },
                                PoseStatus::suspect, "(a factor of 1000: m for mm?)"},
                      ScaleSlip{"SizesInInchAndABarGivesTheScale", 0,
                                [](CampaignScene& made) {
                                  without_nominal(made);
                                  scale_sizes(made, 1 / 25.4);
                                  take_bars(made, {bar_of(made, 0, 4), bar_of(made, 5, 9)});
                                },
                                PoseStatus::suspect, "(a factor of 25.4: inch for mm?)"},
                      ScaleSlip{"SizeOfTheInnerSquareTyped", 0,
                                [](CampaignScene& made) { scale_sizes(made, 0.75); }, PoseStatus::no_datum,
                                "1.333 times as large as the markers' size_mm say"},
                      ScaleSlip{"SizesOfOneGripWrong", 0,
                                [](CampaignScene& made) {
                                  for (auto& [id, size] : made.campaign.moving) size *= 1.02;
                                },
                                PoseStatus::disconnected, "could not be measured"},
                      ScaleSlip{"CoordinatesGiveTheScaleOfAPrintThatIsOff", 0.03,
                                [](CampaignScene& made) { made.campaign.scale = ScaleFrom::nominal; },
                                PoseStatus::suspect, "nothing confirms it"},
                      ScaleSlip{"CoordinatesGiveTheScaleAndABarConfirmsIt", 0.03,
                                [](CampaignScene& made) {
                                  made.campaign.scale = ScaleFrom::nominal;
                                  made.campaign.bars.push_back(bar_of(made, 0, 4));
                                },
                                PoseStatus::ok, "the markers are printed "}),
    [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace hexcal
