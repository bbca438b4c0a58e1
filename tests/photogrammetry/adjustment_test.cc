#include "photogrammetry/adjustment/adjustment.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <chrono>
#include <cmath>
#include <numeric>

#include "photogrammetry/adjustment/marker_map.h"
#include "photogrammetry/markers/detect.h"
#include "tests/support/error_matchers.h"
#include "tests/support/observation_scene.h"
#include "tests/support/rigid_matchers.h"
#include "tests/support/scene_errors.h"

namespace hexcal {
namespace {

void expect_exact(const ObservationScene& scene, const AdjustmentResult& result) {
  ASSERT_EQ(result.status, AdjustmentStatus::ok) << result.reason;
  const PoseErrors errors = pose_errors(scene, result);
  EXPECT_LT(errors.rms_um, 1e-4);
  EXPECT_LT(errors.rms_mdeg, 1e-4);
  EXPECT_LT(result.rms_px, 1e-7);
}

TEST(Adjustment, NoiseFreeSceneIsRecoveredExactly) {
  const ObservationScene scene = make_observation_scene({});
  expect_exact(scene, adjust_network(scene.network, {}));
}

TEST(Adjustment, NoiseOfOneHundredthPixelStaysWithinTheBudget) {
  ObservationSceneOptions options;
  options.noise_px = 0.01;
  const ObservationScene scene = make_observation_scene(options);
  const AdjustmentResult result = adjust_network(scene.network, {});
  ASSERT_EQ(result.status, AdjustmentStatus::ok) << result.reason;
  const PoseErrors errors = pose_errors(scene, result);
  EXPECT_LT(errors.rms_um, 1.5);
  EXPECT_LT(errors.rms_mdeg, 1.5);
  EXPECT_NEAR(result.sigma0, 1.0, 0.06);
  EXPECT_FALSE(result.shape_free);
  for (const ResidualSummary& photo : result.photo_residuals) EXPECT_EQ(photo.rejected, 0);
}

TEST(Adjustment, CovariancesAreHonestOverManySeeds) {
  for (const double interior : {0.0, 1.0}) {
    for (const auto mode : {AdjustmentOptions::Interior::refined, AdjustmentOptions::Interior::fixed}) {
      if (interior == 0 && mode == AdjustmentOptions::Interior::fixed) continue;  // the same thing
      double sum = 0;
      // A fixed interior orientation errs once per seed, not once per pose.
      const int seeds = interior == 0 ? 14 : mode == AdjustmentOptions::Interior::fixed ? 30 : 8;
      for (int seed = 0; seed < seeds; ++seed) {
        ObservationSceneOptions options;
        options.num_epochs = 4;
        options.noise_px = 0.01;
        options.interior_sigma = interior;
        options.seed = static_cast<unsigned>(100 + seed);
        const ObservationScene scene = make_observation_scene(options);
        AdjustmentOptions adjust;
        adjust.interior = mode;
        const AdjustmentResult result = adjust_network(scene.network, adjust);
        ASSERT_EQ(result.status, AdjustmentStatus::ok) << result.reason;
        EXPECT_FALSE(result.interior_loosened);
        sum += mean_normalised_square(scene, result) / seeds;
      }
      EXPECT_GT(sum, 0.7) << "interior " << interior << " mode " << static_cast<int>(mode);
      EXPECT_LT(sum, 1.4) << "interior " << interior << " mode " << static_cast<int>(mode);
    }
  }
}

TEST(Adjustment, AFixedInteriorOrientationWidensTheSigmas) {
  ObservationSceneOptions options;
  options.noise_px = 0.01;
  options.interior_sigma = 1;
  const ObservationScene scene = make_observation_scene(options);
  AdjustmentOptions adjust;
  const AdjustmentResult refined = adjust_network(scene.network, adjust);
  adjust.interior = AdjustmentOptions::Interior::fixed;
  const AdjustmentResult fixed = adjust_network(scene.network, adjust);
  EXPECT_GT(fixed.pose_covariance(3, 3).trace(), refined.pose_covariance(3, 3).trace());
  EXPECT_LT(pose_errors(scene, refined).rms_um, 2.0);
}

TEST(Adjustment, ObservationsThatPromiseTooMuchScaleTheSigmas) {
  ObservationSceneOptions options;
  options.noise_px = 0.03;
  options.stated_noise_px = 0.01;
  const ObservationScene scene = make_observation_scene(options);
  const AdjustmentResult result = adjust_network(scene.network, {});
  EXPECT_NEAR(result.sigma0, 3.0, 0.2);
  EXPECT_GT(mean_normalised_square(scene, result), 0.5);
  EXPECT_LT(mean_normalised_square(scene, result), 2.0);
}

TEST(Adjustment, CornersAreFreedWhenTheEvidenceAsks) {
  ObservationSceneOptions options;
  options.noise_px = 0.01;
  options.shape_sigma_mm = 0.03;
  const ObservationScene scene = make_observation_scene(options);
  const AdjustmentResult result = adjust_network(scene.network, {});
  ASSERT_EQ(result.status, AdjustmentStatus::ok) << result.reason;
  EXPECT_TRUE(result.shape_free);
  EXPECT_NEAR(result.sigma0, 1.0, 0.08);
  EXPECT_LT(pose_errors(scene, result).rms_um, 12.0);
  for (const ResidualSummary& photo : result.photo_residuals) EXPECT_EQ(photo.rejected, 0);
}

TEST(Adjustment, BarsGiveTheScaleOfMisprintedMarkers) {
  ObservationSceneOptions options;
  options.noise_px = 0.01;
  options.print_scale = 0.01;
  ObservationScene scene = make_observation_scene(options);
  const double length =
      (scene.body_from_marker[0].translation - scene.body_from_marker[9].translation).norm();
  scene.network.lengths.push_back({0, -1, 9, -1, length, 0.002});
  AdjustmentOptions adjust;
  adjust.print_scale_free = true;
  const AdjustmentResult result = adjust_network(scene.network, adjust);
  ASSERT_EQ(result.status, AdjustmentStatus::ok) << result.reason;
  EXPECT_NEAR(result.geometry.print_scale, 0.01, 2e-4);
  EXPECT_LT(pose_errors(scene, result).rms_um, 2.0);
}

std::size_t fixed_observation(const ObservationScene& scene, std::size_t photo) {
  const auto& markers = scene.network.photos[photo].observations;
  for (std::size_t i = 0; i < markers.size(); ++i) {
    if (markers[i].id < 100) return i;
  }
  return 0;
}

TEST(Adjustment, MovedFixedMarkerIsLeftOutOfItsPose) {
  ObservationSceneOptions options;
  options.noise_px = 0.01;
  ObservationScene scene = make_observation_scene(options);
  const double clean = pose_errors(scene, adjust_network(scene.network, {})).rms_um;
  const Rigid3 moved = Rigid3::from_translation({0.5, -0.3, 0.4}) * scene.body_from_marker[2];
  int touched = 0;
  for (std::size_t p = 12; p < 15; ++p) {  // the photographs of epoch 4
    for (Observation& seen : scene.network.photos[p].observations) {
      if (seen.id != 2) continue;
      Vector8d px;
      ASSERT_TRUE(project_drawn({scene.true_camera, scene.camera_from_fixed[p], nullptr, moved},
                                scene.network.features[2], px, nullptr));
      seen.px = px;
      ++touched;
    }
  }
  ASSERT_GE(touched, 2);
  const AdjustmentResult result = adjust_network(scene.network, {});
  EXPECT_EQ(result.epoch_residuals[4].rejected, touched);
  EXPECT_EQ(result.feature_residuals[2].rejected, touched);
  EXPECT_LT(pose_errors(scene, result).rms_um, 2 * clean);
}

TEST(Adjustment, MislabelledMarkerAndSingleBadCornerAreTakenOut) {
  ObservationSceneOptions options;
  options.noise_px = 0.01;
  ObservationScene scene = make_observation_scene(options);
  const double clean = pose_errors(scene, adjust_network(scene.network, {})).rms_um;
  auto& first = scene.network.photos[7].observations;
  ASSERT_GE(first.size(), 4U);
  std::swap(first[0].px, first[1].px);
  auto& other = scene.network.photos[20].observations[fixed_observation(scene, 20)];
  other.px.segment<2>(4) += Eigen::Vector2d(0.5, -0.4);
  const AdjustmentResult result = adjust_network(scene.network, {});
  EXPECT_EQ(result.photo_residuals[7].rejected, 2);
  EXPECT_EQ(result.photo_residuals[20].rejected, 0);
  int without_corner = 0;
  for (const Sighting& sighting : result.sightings) {
    if (sighting.photo == 20 && sighting.rows == 6) {
      EXPECT_FALSE(sighting.point_used[2]);
      ++without_corner;
    }
  }
  EXPECT_EQ(without_corner, 1);
  EXPECT_LT(pose_errors(scene, result).rms_um, 1.5 * clean);
}

TEST(Adjustment, DisconnectedPhotographIsNamedAndTheRestGoesOn) {
  ObservationSceneOptions options;
  options.noise_px = 0.01;
  ObservationScene scene = make_observation_scene(options);
  scene.network.photos[9].observations.clear();
  for (std::size_t p :
       {std::size_t{15}, std::size_t{16}, std::size_t{17}}) {  // epoch 5 sees the moving grip only
    std::erase_if(scene.network.photos[p].observations,
                  [](const Observation& seen) { return seen.id < 100; });
  }
  std::erase_if(scene.network.photos[18].observations, [](const Observation& seen) { return seen.id < 100; });
  const AdjustmentResult result = adjust_network(scene.network, {});
  ASSERT_EQ(result.status, AdjustmentStatus::ok) << result.reason;
  EXPECT_FALSE(result.geometry.has_photo[9]);
  EXPECT_FALSE(result.geometry.has_photo[15]);
  EXPECT_FALSE(result.geometry.has_pose[kMovingBody][5]);
  EXPECT_TRUE(result.geometry.has_photo[18]);  // held by the moving grip, whose pose the other two give
  EXPECT_LT(pose_errors(scene, result).rms_um, 2.0);
}

TEST(Adjustment, MarkerSeenOnceIsNotUsed) {
  ObservationSceneOptions options;
  options.noise_px = 0.01;
  ObservationScene scene = make_observation_scene(options);
  bool kept = false;
  for (NetworkPhoto& photo : scene.network.photos) {
    std::erase_if(photo.observations, [&](const Observation& seen) {
      if (seen.id != 102) return false;
      const bool erase = kept;
      kept = true;
      return erase;
    });
  }
  const AdjustmentResult result = adjust_network(scene.network, {});
  ASSERT_EQ(result.status, AdjustmentStatus::ok);
  EXPECT_FALSE(result.geometry.has_feature[12]);
  EXPECT_EQ(std::count_if(result.sightings.begin(), result.sightings.end(),
                          [](const Sighting& s) { return s.status == SightingStatus::seen_once; }),
            1);
}

TEST(Adjustment, RefusesWhenNothingIsConnected) {
  ObservationScene scene = make_observation_scene({.num_epochs = 2});
  for (NetworkPhoto& photo : scene.network.photos) photo.observations.clear();
  const AdjustmentResult result = adjust_network(scene.network, {});
  EXPECT_EQ(result.status, AdjustmentStatus::nothing_connected);
  EXPECT_FALSE(result.reason.empty());
}

TEST(Adjustment, ASingleMarkerInTwoPhotographsIsEnoughUnlessItsShapeIsFree) {
  ObservationSceneOptions options;
  options.noise_px = 0.01;
  options.num_epochs = 1;
  options.stations = 2;
  for (const bool calibrated : {false, true}) {
    options.interior_sigma = calibrated ? 1 : 0;
    ObservationScene scene = make_observation_scene(options);
    for (NetworkPhoto& photo : scene.network.photos)
      std::erase_if(photo.observations, [](const Observation& m) { return m.id != 2; });
    for (const auto interior : {AdjustmentOptions::Interior::refined, AdjustmentOptions::Interior::fixed}) {
      AdjustmentOptions how;
      how.interior = interior;
      const AdjustmentResult result = adjust_network(scene.network, how);
      EXPECT_EQ(result.status, AdjustmentStatus::ok) << result.reason;
      EXPECT_NEAR(result.redundancy_total, 4, 0.1);  // 16 coordinates, 12 of the cameras
    }
  }
  options.interior_sigma = 0;
  ObservationScene scene = make_observation_scene(options);
  for (NetworkPhoto& photo : scene.network.photos)
    std::erase_if(photo.observations, [](const Observation& m) { return m.id != 2; });
  scene.network.photos[0].observations.at(0).px.segment<2>(2) += Eigen::Vector2d(30, 10);
  AdjustmentOptions free_shape;
  free_shape.shape = AdjustmentOptions::Shape::free;
  const AdjustmentResult result = adjust_network(scene.network, free_shape);
  EXPECT_EQ(result.status, AdjustmentStatus::no_redundancy);
  EXPECT_EQ(result.reason, "there are no more observations than unknowns, so nothing checks the result");
  EXPECT_LT(result.redundancy_total, 1);
}

TEST(Adjustment, AChangedCameraLoosensThePrior) {
  ObservationSceneOptions options;
  options.noise_px = 0.01;
  options.interior_sigma = 1;
  ObservationScene scene = make_observation_scene(options);
  scene.network.cameras[0].model.parameters[0] += 20;
  const AdjustmentResult result = adjust_network(scene.network, {});
  EXPECT_TRUE(result.interior_loosened);
  EXPECT_LT(pose_errors(scene, result).rms_um, 4.0);
}

TEST(Adjustment, SmallDistantMarkersResolveTheirTwofoldAmbiguity) {
  ObservationSceneOptions options;
  options.noise_px = 0.15;
  options.size_mm = 5;
  const ObservationScene scene = make_observation_scene(options);
  const AdjustmentResult result = adjust_network(scene.network, {});
  ASSERT_EQ(result.status, AdjustmentStatus::ok) << result.reason;
  EXPECT_NEAR(result.sigma0, 1.0, 0.08);
  for (const ResidualSummary& photo : result.photo_residuals) EXPECT_EQ(photo.rejected, 0);
}

std::vector<int> first_epochs(int count) {
  std::vector<int> epochs(static_cast<std::size_t>(count));
  std::iota(epochs.begin(), epochs.end(), 0);
  return epochs;
}

TEST(MarkerMap, NoiseFreeSceneIsRecoveredExactly) {
  const ObservationScene scene = make_observation_scene({});
  expect_exact(scene, adjust_network_by_map(scene.network, first_epochs(4), {}));
}

TEST(MarkerMap, EpochsOnTheMapStateHonestSigmasAndLoseLittle) {
  double normalised = 0;
  double by_map_um = 0;
  double at_once_um = 0;
  constexpr int kSeeds = 5;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    ObservationSceneOptions options;
    options.num_epochs = 24;
    options.noise_px = 0.01;
    options.interior_sigma = 1;
    options.seed = 300 + seed;
    const ObservationScene scene = make_observation_scene(options);
    const AdjustmentResult by_map = adjust_network_by_map(scene.network, first_epochs(8), {});
    ASSERT_EQ(by_map.status, AdjustmentStatus::ok) << by_map.reason;
    normalised += mean_normalised_square(scene, by_map) / kSeeds;
    by_map_um += pose_errors(scene, by_map).rms_um / kSeeds;
    at_once_um += pose_errors(scene, adjust_network(scene.network, {})).rms_um / kSeeds;
    for (const ResidualSummary& photo : by_map.photo_residuals) EXPECT_EQ(photo.rejected, 0);
  }
  EXPECT_GT(normalised, 0.7);
  EXPECT_LT(normalised, 1.4);
  EXPECT_LT(by_map_um, 1.5 * at_once_um);
}

TEST(MarkerMap, AMovedMarkerIsLeftOutOfItsEpochAlone) {
  ObservationSceneOptions options;
  options.noise_px = 0.01;
  ObservationScene scene = make_observation_scene(options);
  int moved = 0;
  for (NetworkPhoto& photo : scene.network.photos) {
    if (photo.epoch != 9) continue;
    for (int c = 0; c < 4; ++c) photo.observations[0].px[2 * c] += 2;
    ++moved;
  }
  const AdjustmentResult result = adjust_network_by_map(scene.network, first_epochs(6), {});
  ASSERT_EQ(result.status, AdjustmentStatus::ok) << result.reason;
  for (std::size_t p = 0; p < scene.network.photos.size(); ++p) {
    EXPECT_EQ(result.photo_residuals[p].rejected, scene.network.photos[p].epoch == 9 ? 1 : 0);
  }
  EXPECT_EQ(result.epoch_residuals[9].rejected, moved);
  EXPECT_LT(pose_errors(scene, result).rms_um, 2);
}

TEST(Adjustment, OptionsAreRefusedByName) {
  expect_option_refused<AdjustmentOptions>("squareness_sigma_mm: found 0, wanted more than 0",
                                           [](auto& o) { o.squareness_sigma_mm = 0; });
  expect_option_refused<AdjustmentOptions>("outlier_probability: found 0.5, wanted below 0.5",
                                           [](auto& o) { o.outlier_probability = 0.5; });
  expect_option_refused<AdjustmentOptions>("print_scale_sigma: found nan, wanted 0 or more",
                                           [](auto& o) { o.print_scale_sigma = std::nan(""); });
  expect_option_refused<DetectionOptions>("ids has -1, wanted none below 0", [](auto& o) { o.ids = {-1}; });
  expect_option_refused<DetectionOptions>("min_side_px is 1, wanted 4 to 100000",
                                          [](auto& o) { o.refine.min_side_px = 1; });
}

TEST(Adjustment, SameInputGivesTheSameBits) {
  ObservationSceneOptions options;
  options.noise_px = 0.01;
  options.num_epochs = 4;
  const ObservationScene scene = make_observation_scene(options);
  const AdjustmentResult a = adjust_network(scene.network, {});
  const AdjustmentResult b = adjust_network(scene.network, {});
  for (std::size_t e = 0; e < 4; ++e) {
    EXPECT_EQ(a.geometry.reference_from_body[kMovingBody][e].matrix(),
              b.geometry.reference_from_body[kMovingBody][e].matrix());
  }
}

}  // namespace
}  // namespace hexcal
