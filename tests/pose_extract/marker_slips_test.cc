#include "pose_extract/marker_slips.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <functional>
#include <set>

#include "pose_extract/extract_poses.h"
#include "pose_extract/pose_verdict.h"
#include "tests/support/campaign_scene.h"

namespace hexcal {
namespace {

using ::testing::HasSubstr;

CampaignScene steady_scene(int epochs, unsigned seed) {
  ObservationSceneOptions options;
  options.num_epochs = epochs;
  options.noise_px = 0.01;
  options.seed = seed;
  return make_campaign_scene(options);
}

// Markers as they are seen from epoch `first` on, shifted on their body by this much.
void shift_markers(CampaignScene& made, const std::set<int>& ids, std::size_t first,
                   const Eigen::Vector3d& shift_mm) {
  const ObservationScene& scene = made.scene;
  for (std::size_t p = 0; p < made.observations.photographs.size(); ++p) {
    const auto epoch = static_cast<std::size_t>(scene.network.photos[p].epoch);
    if (epoch < first) continue;
    for (MarkerObservation& marker : made.observations.photographs[p].seen.markers) {
      if (ids.count(marker.id) == 0) continue;
      const auto m = static_cast<std::size_t>(marker.id < 100 ? marker.id : marker.id - 90);
      const Rigid3* motion = marker.id < 100 ? nullptr : &scene.fixed_from_moving[epoch];
      const Rigid3 shifted(scene.body_from_marker[m].rotation,
                           scene.body_from_marker[m].translation + shift_mm);
      Vector8d before, after;
      ASSERT_TRUE(
          project_drawn({scene.true_camera, scene.camera_from_fixed[p], motion, scene.body_from_marker[m]},
                        scene.network.features[m], before, nullptr));
      ASSERT_TRUE(project_drawn({scene.true_camera, scene.camera_from_fixed[p], motion, shifted},
                                scene.network.features[m], after, nullptr));
      for (int c = 0; c < 4; ++c)
        marker.corners_px[static_cast<std::size_t>(c)] += (after - before).segment<2>(2 * c);
    }
  }
}

std::set<int> ids(int first, int last) {
  std::set<int> all;
  for (int id = first; id <= last; ++id) all.insert(id);
  return all;
}

struct BumpCase {
  const char* name;
  std::set<int> markers;
  std::size_t first;
  Eigen::Vector3d shift_mm;
  bool later_suspect;
  const char* words;
};

class Bumps : public ::testing::TestWithParam<BumpCase> {};

TEST_P(Bumps, AreNamedAndNoPoseThatIsOkIsWrong) {
  const BumpCase& test = GetParam();
  CampaignScene made = steady_scene(9, 6);
  shift_markers(made, test.markers, test.first, test.shift_mm);
  const CampaignResult result = extract_poses(made.campaign, made.observations);
  const std::string all = findings_text(result);
  EXPECT_THAT(all, HasSubstr(test.words));
  for (std::size_t e = 1; e < result.poses.size(); ++e) {
    const MeasuredPose& pose = result.poses[e];
    ASSERT_TRUE(pose.pose) << pose.words;
    // Where half of them moved, which half is not known, and when not to the pose.
    if (e >= test.first || !test.later_suspect) {
      EXPECT_EQ(pose.status == PoseStatus::suspect, test.later_suspect) << pose.words << all;
    }
    if (pose.status != PoseStatus::ok) continue;
    const Vector6d z =
        pose_error(*pose.pose, true_pose(made, e)).cwiseQuotient(pose.covariance.diagonal().cwiseSqrt());
    EXPECT_LT(z.cwiseAbs().maxCoeff(), 4) << pose.id << ": " << z.transpose();
  }
}

const Eigen::Vector3d kBump(0.12, -0.1, 0.14);  // 0.21 mm

INSTANTIATE_TEST_SUITE_P(
    Markers, Bumps,
    ::testing::Values(
        BumpCase{"None", {}, 5, kBump, false, ""},
        BumpCase{"OneFixedSticker",
                 {3},
                 5,
                 kBump,
                 false,
                 "marker 3 of the fixed grip moved by 0.21 mm between p04 and p05"},
        BumpCase{"OneFixedStickerByLittle",
                 {3},
                 5,
                 0.1 * kBump,
                 false,
                 "marker 3 of the fixed grip moved by 0.02"},
        BumpCase{"OneFixedStickerAtOnce",
                 {3},
                 1,
                 kBump,
                 false,
                 "marker 3 of the fixed grip moved by 0.21 mm between home and p01"},
        BumpCase{"OneFixedStickerAtTheEnd", {3}, 8, kBump, false, "marker 3 "},
        BumpCase{"OneMovingSticker",
                 {104},
                 4,
                 kBump,
                 false,
                 "marker 104 of the moving grip moved by 0.21 mm between p03 and p04"},
        BumpCase{"TwoFixedStickers", {1, 7}, 5, kBump, false, "marker 7 of the fixed grip moved by 0.21 mm"},
        BumpCase{"HalfOfTheFixedGrip", ids(0, 4), 5, kBump, true,
                 "the fixed markers moved between p04 and p05"},
        BumpCase{"HalfOfTheMovingGrip", ids(105, 109), 3, kBump, true, "the moving markers moved between "}),
    [](const auto& test) { return std::string(test.param.name); });

// All fixed markers move together: only the commanded poses know.
TEST(WholeGripBumped, IsAStepAgainstTheTargets) {
  for (const bool bumped : {false, true}) {
    CampaignScene made = steady_scene(20, 2);
    if (bumped) shift_markers(made, ids(0, 9), 12, kBump);
    CampaignResult result = extract_poses(made.campaign, made.observations);
    std::map<std::string, Pose> targets;
    for (std::size_t e = 0; e < result.poses.size(); ++e) {
      // A machine with an error of its own, a millimetre and more.
      Pose target = true_pose(made, e);
      if (e > 0) {
        const Eigen::Vector3d p = target.position_mm;
        target.position_mm += Eigen::Vector3d(0.5, -0.3, 0.2) + 0.02 * p +
                              0.01 * Eigen::Vector3d(p.y(), p.z(), p.x()) + 1e-4 * p.cwiseProduct(p);
      }
      targets[result.poses[e].id] = target;
    }
    judge_against_targets(targets, result);
    const std::string all = findings_text(result);
    if (!bumped) {
      EXPECT_EQ(all, "");
      continue;
    }
    EXPECT_THAT(all, HasSubstr("a grip or the base moved between p11 and p12 by 0.2"));
    for (std::size_t e = 1; e < 20; ++e)
      EXPECT_EQ(result.poses[e].status, e < 12 ? PoseStatus::ok : PoseStatus::suspect) << e;
  }
}

// gd_mm as it was not meant.
TEST(WrongOrigin, IsNamedWhereTheTargetsKnowBetter) {
  for (const double gd_mm : {50.0, 53.0, 500.0}) {
    CampaignScene made = steady_scene(7, 2);
    std::map<std::string, Pose> targets;
    for (std::size_t e = 0; e < 7; ++e) {
      Pose target = true_pose(made, e);
      if (e > 0) target.position_mm += Eigen::Vector3d(0.2, -0.3, 0.1) + 0.01 * target.position_mm;
      targets[made.observations.poses[e]] = target;
    }
    made.campaign.lg->gd_mm = gd_mm;
    CampaignResult result = extract_poses(made.campaign, made.observations);
    judge_against_targets(targets, result);
    const bool wrong = gd_mm > 60;
    ASSERT_EQ(result.findings.size(), wrong ? 1U : 0U) << gd_mm;
    EXPECT_EQ(result.poses[3].status, wrong ? PoseStatus::suspect : PoseStatus::ok);
    if (!wrong) continue;
    EXPECT_THAT(
        result.findings[0].cause,
        ::testing::ContainsRegex("LG's origin lies elsewhere by \\(-?[0-9], -?[0-9], -4[45][0-9]\\) mm"));
  }
}

TEST(PhotographingOrder, IsThatOfTheCaptureTimesWhereAllHaveOne) {
  CampaignScene made = steady_scene(3, 1);
  EXPECT_EQ(photographing_order(made.observations), (std::vector<std::size_t>{0, 1, 2}));
  for (std::size_t p = 0; p < made.observations.photographs.size(); ++p)
    made.observations.photographs[p].seen.info.capture_time = fmt::format("2026:05:01 10:{:02}:00", 30 - p);
  EXPECT_EQ(photographing_order(made.observations), (std::vector<std::size_t>{2, 1, 0}));
  made.observations.photographs[4].seen.info.capture_time.reset();
  EXPECT_EQ(photographing_order(made.observations), (std::vector<std::size_t>{0, 1, 2}));
}

// A copy of a photograph: as it is, saved again, turned; or the next one of a burst, with noise of its own.
TEST(Copies, OfAPhotographCountOnce) {
  struct CopyCase {
    const char* name;
    double saved_px, noise_px;
    bool turned, copy;
  };
  for (const CopyCase& test :
       {CopyCase{"same pixels", 0, 0, false, true}, CopyCase{"saved again", 0.002, 0, false, true},
        CopyCase{"turned", 0.002, 0, true, true},
        CopyCase{"of a burst", 0, 0.01 * std::sqrt(2.0), false, false}}) {
    CampaignScene made = steady_scene(3, 4);
    const double sigma = std::sqrt(
        extract_poses(made.campaign, made.observations).poses[1].covariance.topLeftCorner<3, 3>().trace());
    std::mt19937_64 rng(7);
    std::normal_distribution<double> normal(0, test.saved_px + test.noise_px);
    const CampaignPhotograph original = made.observations.photographs[3];
    ASSERT_EQ(original.pose, "p01");
    for (int i = 0; i < 20; ++i) {
      CampaignPhotograph copy = original;
      copy.seen.name = fmt::format("p01/copy{}.jpg", i);
      copy.seen.sha256 = fmt::format("{:064d}", 1000 + i);
      for (MarkerObservation& marker : copy.seen.markers) {
        for (Eigen::Vector2d& corner : marker.corners_px) {
          corner += Eigen::Vector2d(normal(rng), normal(rng));
          if (test.turned)
            corner = Eigen::Vector2d(copy.seen.info.width_px - 1, copy.seen.info.height_px - 1) - corner;
        }
      }
      made.observations.photographs.push_back(copy);
    }
    const CampaignResult result = extract_poses(made.campaign, made.observations);
    EXPECT_EQ(result.photographs.back().status == PhotoStatus::duplicate, test.copy) << test.name;
    EXPECT_EQ(result.poses[1].images, test.copy ? 3 : 23) << test.name;
    if (!test.copy) continue;
    const double after = std::sqrt(result.poses[1].covariance.topLeftCorner<3, 3>().trace());
    EXPECT_NEAR(after, sigma, 0.05 * sigma) << test.name;
    EXPECT_THAT(result.photographs.back().words, HasSubstr("a copy of p01/IMG_0003.JPG"));
  }
}

}  // namespace
}  // namespace hexcal
