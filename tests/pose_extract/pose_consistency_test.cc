#include "pose_extract/pose_consistency.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "tests/support/campaign_scene.h"

namespace hexcal {
namespace {

using ::testing::HasSubstr;

// The moving markers of a photograph as seen with the body displaced (mm, rad; about the body's origin) from
// where its pose has it. Noise that is in the observations stays.
void displace(CampaignScene& made, std::size_t p, const Vector6d& delta) {
  const ObservationScene& scene = made.scene;
  const Rigid3& still = scene.fixed_from_moving[static_cast<std::size_t>(scene.network.photos[p].epoch)];
  const Rigid3 moved = perturbed(still, delta);
  for (MarkerObservation& marker : made.observations.photographs[p].seen.markers) {
    if (marker.id < 100) continue;
    const auto m = static_cast<std::size_t>(marker.id) - 90;
    Vector8d before, after;
    ASSERT_TRUE(
        project_drawn({scene.true_camera, scene.camera_from_fixed[p], &still, scene.body_from_marker[m]},
                      scene.network.features[m], before, nullptr));
    ASSERT_TRUE(
        project_drawn({scene.true_camera, scene.camera_from_fixed[p], &moved, scene.body_from_marker[m]},
                      scene.network.features[m], after, nullptr));
    for (int c = 0; c < 4; ++c)
      marker.corners_px[static_cast<std::size_t>(c)] += (after - before).segment<2>(2 * c);
  }
}

CampaignScene clean_scene(unsigned seed, int epochs = 7) {
  ObservationSceneOptions options;
  options.num_epochs = epochs;
  options.noise_px = 0.01;
  options.seed = seed;
  return make_campaign_scene(options);
}

struct Honesty {
  double squares = 0;
  int numbers = 0, ok = 0, suspect = 0, failed = 0;
  double worst_ok = 0;
  void add(const CampaignScene& made, const CampaignResult& result) {
    for (std::size_t e = 1; e < result.poses.size(); ++e) {
      const MeasuredPose& pose = result.poses[e];
      ++(pose.status == PoseStatus::ok ? ok : pose.status == PoseStatus::suspect ? suspect : failed);
      if (!pose.pose) continue;
      const Vector6d error = pose_error(*pose.pose, true_pose(made, e));
      const Vector6d z = error.cwiseQuotient(pose.covariance.diagonal().cwiseSqrt());
      squares += z.squaredNorm();
      numbers += 6;
      if (pose.status == PoseStatus::ok) worst_ok = std::max(worst_ok, z.cwiseAbs().maxCoeff());
    }
  }
  [[nodiscard]] double rms() const { return std::sqrt(squares / numbers); }
};

// All photographs' bodies displaced by normal tremble, seeds 1 to `seeds`.
Honesty tremble(double sigma_mm, double sigma_rad, unsigned seeds) {
  Honesty honesty;
  for (unsigned seed = 1; seed <= seeds; ++seed) {
    CampaignScene made = clean_scene(seed, 5);
    std::mt19937_64 rng(seed);
    std::normal_distribution<double> normal(0, 1);
    for (std::size_t p = 0; p < made.observations.photographs.size(); ++p) {
      Vector6d delta;
      for (int i = 0; i < 6; ++i) delta[i] = (i < 3 ? sigma_mm : sigma_rad) * normal(rng);
      displace(made, p, delta);
    }
    honesty.add(made, extract_poses(made.campaign, made.observations));
  }
  return honesty;
}

TEST(PoseConsistency, SteadyBodyKeepsItsSigmasAndIsOk) {
  const CampaignScene made = clean_scene(3);
  const CampaignResult result = extract_poses(made.campaign, made.observations);
  for (std::size_t e = 0; e < result.poses.size(); ++e) {
    EXPECT_EQ(result.poses[e].status, PoseStatus::ok) << result.poses[e].words;
    EXPECT_FALSE(result.consistency.epochs[e].stands_out);
    EXPECT_LT(result.consistency.epochs[e].excess.trace(),
              0.1 * result.adjusted.reference_from_body(static_cast<int>(e)).own.trace());
  }
}

TEST(PoseConsistency, TrembleOfTheNoisesSizeIsInTheSigma) {
  const Honesty honesty = tremble(0.001, 1e-5, 6);
  EXPECT_EQ(honesty.failed, 0);
  EXPECT_GT(honesty.rms(), 0.75);
  EXPECT_LT(honesty.rms(), 1.3);
}

TEST(PoseConsistency, TrembleOf20umIsSuspectAndItsSigmaCovers) {
  const Honesty honesty = tremble(0.020, 2e-4, 3);
  EXPECT_EQ(honesty.ok, 0);
  EXPECT_GT(honesty.suspect, 0);
  EXPECT_GT(honesty.rms(), 0.6);
  EXPECT_LT(honesty.rms(), 1.5);
}

TEST(PoseConsistency, TheOnePoseThatMovedIsNamedAndTheOthersStay) {
  CampaignScene made = clean_scene(2);
  // Drifts by 0.03 mm through its photographs, 9 to 11.
  for (std::size_t i = 0; i < 3; ++i) {
    Vector6d delta = Vector6d::Zero();
    delta[1] = 0.015 * (static_cast<double>(i) - 1);
    displace(made, 9 + i, delta);
  }
  const CampaignResult result = extract_poses(made.campaign, made.observations);
  const MeasuredPose& moved = result.poses[3];
  EXPECT_EQ(moved.status, PoseStatus::suspect);
  EXPECT_THAT(moved.words, HasSubstr("it moved by 0.03"));
  EXPECT_GT(moved.covariance(1, 1), 0.005 * 0.005);
  for (const std::size_t e : {0, 1, 2, 4, 5, 6}) {
    EXPECT_EQ(result.poses[e].status, PoseStatus::ok) << result.poses[e].words;
    EXPECT_LT(result.poses[e].covariance(1, 1), 0.003 * 0.003);
  }
}

}  // namespace
}  // namespace hexcal
