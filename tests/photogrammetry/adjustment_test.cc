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

namespace hexcal {
namespace {

// The fixed body's true frame from the adjustment's: the best fit over all fixed corners.
Rigid3 true_from_adjusted(const ObservationScene& scene, const AdjustmentResult& result) {
  Eigen::Matrix3Xd from(3, 0);
  Eigen::Matrix3Xd to(3, 0);
  for (std::size_t m = 0; m < scene.network.markers.size(); ++m) {
    if (scene.network.markers[m].body != Body::fixed || !result.geometry.has_marker[m]) continue;
    const auto adjusted = marker_corners_in_body(scene.network, result.geometry, static_cast<int>(m));
    for (int c = 0; c < 4; ++c) {
      from.conservativeResize(3, from.cols() + 1);
      to.conservativeResize(3, to.cols() + 1);
      from.rightCols<1>() = adjusted.col(c);
      to.rightCols<1>() = scene.body_from_marker[m] *
                          corner_in_marker(c, scene.network.markers[m].size_mm, scene.shape_mm[m]);
    }
  }
  const Eigen::Matrix4d t = Eigen::umeyama(from, to, false);
  return {Eigen::Matrix3d(t.topLeftCorner<3, 3>()), t.topRightCorner<3, 1>()};
}

struct PoseErrors {
  double rms_um = 0, rms_mdeg = 0;
};

// 3D rms of the motions from home to each pose, in true axes: free of the gauge of both bodies.
PoseErrors pose_errors(const ObservationScene& scene, const AdjustmentResult& result) {
  const Rigid3 to_true = true_from_adjusted(scene, result);
  const std::vector<Rigid3>& found_from_moving = result.geometry.fixed_from_moving;
  double mm2 = 0;
  double rad2 = 0;
  double count = 0;
  for (std::size_t e = 1; e < scene.fixed_from_moving.size(); ++e) {
    if (!result.geometry.has_epoch[e]) continue;
    const Rigid3 found = to_true * found_from_moving[e] * inverse(found_from_moving[0]) * inverse(to_true) *
                         scene.fixed_from_moving[0];
    const Vector6d delta = perturbation_between(scene.fixed_from_moving[e], found);
    mm2 += delta.head<3>().squaredNorm();
    rad2 += delta.tail<3>().squaredNorm();
    count += 1;
  }
  return {std::sqrt(mm2 / count) * 1e3, std::sqrt(rad2 / count) * kDegPerRad * 1e3};
}

// Normalised squares (per degree of freedom) of the error of each epoch's motion relative to the home epoch,
// expressed in the adjustment's own frame, where the covariance is known.
double mean_normalised_square(const ObservationScene& scene, const AdjustmentResult& result) {
  const Rigid3 to_true = true_from_adjusted(scene, result);
  double sum = 0;
  int count = 0;
  const Rigid3& home = result.geometry.fixed_from_moving[0];
  for (std::size_t e = 1; e < scene.fixed_from_moving.size(); ++e) {
    const Rigid3& pose = result.geometry.fixed_from_moving[e];
    // moving(home)_from_moving(e) does not depend on the fixed body's gauge; the moving body's remains and is
    // taken from the truth by comparing in the home epoch.
    const Rigid3 found = inverse(home) * pose;
    const Rigid3 adjusted_from_true_moving = inverse(home) * inverse(to_true) * scene.fixed_from_moving[0];
    const Rigid3 truth = adjusted_from_true_moving * inverse(scene.fixed_from_moving[0]) *
                         scene.fixed_from_moving[e] * inverse(adjusted_from_true_moving);
    const Vector6d delta = perturbation_between(truth, found);
    const Matrix6d jh = product_jacobian_left(inverse(home), pose) * inverse_jacobian(home);
    const Matrix6d je = product_jacobian_right(inverse(home), pose);
    const int i = static_cast<int>(e);
    const Matrix6d cross = jh * epoch_covariance(result, 0, i) * je.transpose();
    const Matrix6d covariance = jh * epoch_covariance(result, 0, 0) * jh.transpose() +
                                je * epoch_covariance(result, i, i) * je.transpose() + cross +
                                cross.transpose();
    for (int k = 0; k < 6; ++k) {
      sum += delta[k] * delta[k] / covariance(k, k);
      ++count;
    }
  }
  return sum / count;
}

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
  EXPECT_GT(epoch_covariance(fixed, 3, 3).trace(), epoch_covariance(refined, 3, 3).trace());
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
  const auto& markers = scene.network.photos[photo].markers;
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
    for (MarkerObservation& seen : scene.network.photos[p].markers) {
      if (seen.id != 2) continue;
      Vector8d px;
      ASSERT_TRUE(project_marker({scene.true_camera, scene.camera_from_fixed[p], nullptr, moved}, 24, 0,
                                 SquareShape::Zero(), px, nullptr));
      for (int c = 0; c < 4; ++c) seen.corners_px[static_cast<std::size_t>(c)] = px.segment<2>(2 * c);
      ++touched;
    }
  }
  ASSERT_GE(touched, 2);
  const AdjustmentResult result = adjust_network(scene.network, {});
  EXPECT_EQ(result.epoch_residuals[4].rejected, touched);
  EXPECT_EQ(result.marker_residuals[2].rejected, touched);
  EXPECT_LT(pose_errors(scene, result).rms_um, 2 * clean);
}

TEST(Adjustment, MislabelledMarkerAndSingleBadCornerAreTakenOut) {
  ObservationSceneOptions options;
  options.noise_px = 0.01;
  ObservationScene scene = make_observation_scene(options);
  const double clean = pose_errors(scene, adjust_network(scene.network, {})).rms_um;
  auto& first = scene.network.photos[7].markers;
  ASSERT_GE(first.size(), 4U);
  std::swap(first[0].corners_px, first[1].corners_px);
  auto& other = scene.network.photos[20].markers[fixed_observation(scene, 20)];
  other.corners_px[2] += Eigen::Vector2d(0.5, -0.4);
  const AdjustmentResult result = adjust_network(scene.network, {});
  EXPECT_EQ(result.photo_residuals[7].rejected, 2);
  EXPECT_EQ(result.photo_residuals[20].rejected, 0);
  int without_corner = 0;
  for (const Sighting& sighting : result.sightings) {
    if (sighting.photo == 20 && sighting.rows == 6) {
      EXPECT_FALSE(sighting.corner_used[2]);
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
  scene.network.photos[9].markers.clear();
  for (std::size_t p :
       {std::size_t{15}, std::size_t{16}, std::size_t{17}}) {  // epoch 5 sees the moving grip only
    std::erase_if(scene.network.photos[p].markers,
                  [](const MarkerObservation& seen) { return seen.id < 100; });
  }
  std::erase_if(scene.network.photos[18].markers,
                [](const MarkerObservation& seen) { return seen.id < 100; });
  const AdjustmentResult result = adjust_network(scene.network, {});
  ASSERT_EQ(result.status, AdjustmentStatus::ok) << result.reason;
  EXPECT_FALSE(result.geometry.has_photo[9]);
  EXPECT_FALSE(result.geometry.has_photo[15]);
  EXPECT_FALSE(result.geometry.has_epoch[5]);
  EXPECT_TRUE(result.geometry.has_photo[18]);  // held by the moving grip, whose pose the other two give
  EXPECT_LT(pose_errors(scene, result).rms_um, 2.0);
}

TEST(Adjustment, MarkerSeenOnceIsNotUsed) {
  ObservationSceneOptions options;
  options.noise_px = 0.01;
  ObservationScene scene = make_observation_scene(options);
  bool kept = false;
  for (NetworkPhoto& photo : scene.network.photos) {
    std::erase_if(photo.markers, [&](const MarkerObservation& seen) {
      if (seen.id != 102) return false;
      const bool erase = kept;
      kept = true;
      return erase;
    });
  }
  const AdjustmentResult result = adjust_network(scene.network, {});
  ASSERT_EQ(result.status, AdjustmentStatus::ok);
  EXPECT_FALSE(result.geometry.has_marker[12]);
  EXPECT_EQ(std::count_if(result.sightings.begin(), result.sightings.end(),
                          [](const Sighting& s) { return s.status == SightingStatus::seen_once; }),
            1);
}

TEST(Adjustment, RefusesWhenNothingIsConnected) {
  ObservationScene scene = make_observation_scene({.num_epochs = 2});
  for (NetworkPhoto& photo : scene.network.photos) photo.markers.clear();
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
      std::erase_if(photo.markers, [](const MarkerObservation& m) { return m.id != 2; });
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
    std::erase_if(photo.markers, [](const MarkerObservation& m) { return m.id != 2; });
  scene.network.photos[0].markers.at(0).corners_px[1] += Eigen::Vector2d(30, 10);
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
    for (Eigen::Vector2d& corner : photo.markers[0].corners_px) corner.x() += 2;
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
    EXPECT_EQ(a.geometry.fixed_from_moving[e].matrix(), b.geometry.fixed_from_moving[e].matrix());
  }
}

}  // namespace
}  // namespace hexcal
