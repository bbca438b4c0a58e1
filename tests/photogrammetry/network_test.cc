#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include "photogrammetry/adjustment/adjustment.h"
#include "tests/support/observation_scene.h"
#include "tests/support/rigid_matchers.h"
#include "tests/support/scene_errors.h"

// What a network can be made of beside two grips with squares: more bodies, stations that several photographs
// share, single points.

namespace hexcal {
namespace {

// A body's frame in the adjustment is that of one of its squares: from there to the true frame.
Rigid3 true_from_adjusted_body(const ObservationScene& scene, const AdjustmentResult& result, int body) {
  for (std::size_t f = 0; f < scene.network.features.size(); ++f) {
    const NetworkFeature& feature = scene.network.features[f];
    if (feature.body == body && feature.points() == 4 && result.geometry.has_feature[f]) {
      return scene.body_from_marker[f] * inverse(result.geometry.body_from_feature[f]);
    }
  }
  return {};
}

// Largest distance of a feature's points and of the bodies' origins from the truth, mm; exact scenes only.
double largest_error_mm(const ObservationScene& scene, const AdjustmentResult& result) {
  double largest = 0;
  std::vector<Rigid3> to_true;
  for (int body = 0; body < scene.network.num_bodies; ++body)
    to_true.push_back(true_from_adjusted_body(scene, result, body));
  for (std::size_t f = 0; f < scene.network.features.size(); ++f) {
    EXPECT_TRUE(result.geometry.has_feature[f]) << f;
    const DrawnPoints points = feature_points_in_body(scene.network, result.geometry, static_cast<int>(f));
    const DrawnPoints drawn = scene.printed_points(f);
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      const auto body = static_cast<std::size_t>(scene.network.features[f].body);
      const Eigen::Vector3d off = to_true[body] * points.col(i) - scene.body_from_marker[f] * drawn.col(i);
      largest = std::max(largest, off.norm());
    }
  }
  for (int body = 1; body < scene.network.num_bodies; ++body) {
    const auto b = static_cast<std::size_t>(body);
    const std::vector<Rigid3>& truth = body == 1 ? scene.fixed_from_moving : scene.fixed_from_second;
    for (std::size_t e = 0; e < truth.size(); ++e) {
      const Rigid3 found = to_true[0] * result.geometry.reference_from_body[b][e] * inverse(to_true[b]);
      largest = std::max(largest, perturbation_between(truth[e], found).head<3>().norm());
    }
  }
  return largest;
}

TEST(Network, TwoMovingBodiesAreMeasuredSideBySide) {
  ObservationSceneOptions options;
  options.moving_bodies = 2;
  options.num_epochs = 4;
  const ObservationScene exact = make_observation_scene(options);
  const AdjustmentResult result = adjust_network(exact.network, {});
  ASSERT_EQ(result.status, AdjustmentStatus::ok) << result.reason;
  EXPECT_LT(largest_error_mm(exact, result), 1e-7);
  // Both bodies hang on the same stations: their errors of one epoch are correlated, and the covariance says
  // so. How often the second body's motion between two epochs lies within its sigmas:
  double squares = 0;
  constexpr int kSeeds = 12;
  options.noise_px = 0.01;
  for (int seed = 0; seed < kSeeds; ++seed) {
    options.seed = static_cast<unsigned>(40 + seed);
    const ObservationScene scene = make_observation_scene(options);
    const AdjustmentResult noisy = adjust_network(scene.network, {});
    ASSERT_EQ(noisy.status, AdjustmentStatus::ok) << noisy.reason;
    EXPECT_GT(noisy.pose_covariance({1, 1}, {1, 2}).norm(), 0);
    const Rigid3 a = noisy.reference_from_body({0, 2}).motion;
    const Rigid3 b = noisy.reference_from_body({1, 2}).motion;
    const Rigid3 moving_from_true = inverse(true_from_adjusted_body(scene, noisy, 2));
    const Rigid3 truth = moving_from_true * inverse(scene.fixed_from_second[0]) * scene.fixed_from_second[1] *
                         inverse(moving_from_true);
    const Vector6d off = perturbation_between(truth, inverse(a) * b);
    const Matrix6d ja = product_jacobian_left(inverse(a), b) * inverse_jacobian(a);
    const Matrix6d jb = product_jacobian_right(inverse(a), b);
    const Matrix6d cross = ja * noisy.pose_covariance({0, 2}, {1, 2}) * jb.transpose();
    const Matrix6d covariance = ja * noisy.pose_covariance({0, 2}, {0, 2}) * ja.transpose() +
                                jb * noisy.pose_covariance({1, 2}, {1, 2}) * jb.transpose() + cross +
                                cross.transpose();
    squares += off.dot(covariance.ldlt().solve(off)) / 6 / kSeeds;
  }
  EXPECT_GT(squares, 0.6);
  EXPECT_LT(squares, 1.5);
}

// Of the motions from the first pose, which do not depend on the bodies' frames.
double mean_position_sigma_mm(const ObservationScene& scene, const AdjustmentResult& result) {
  double sum = 0;
  const Rigid3 home_from_reference = inverse(result.reference_from_body(0).motion);
  for (int e = 1; e < scene.network.num_epochs; ++e) {
    const Rigid3 pose = result.reference_from_body(e).motion;
    const Matrix6d jh = product_jacobian_left(home_from_reference, pose) *
                        inverse_jacobian(result.reference_from_body(0).motion);
    const Matrix6d je = product_jacobian_right(home_from_reference, pose);
    const Matrix6d cross = jh * result.pose_covariance(0, e) * je.transpose();
    const Matrix6d covariance = jh * result.pose_covariance(0, 0) * jh.transpose() +
                                je * result.pose_covariance(e, e) * je.transpose() + cross +
                                cross.transpose();
    sum += std::sqrt(covariance.topLeftCorner<3, 3>().trace()) / (scene.network.num_epochs - 1);
  }
  return sum;
}

TEST(Network, FixedStationsHalveTheSigmasOfThePoses) {
  ObservationSceneOptions options;
  options.fixed_stations = true;
  const ObservationScene exact = make_observation_scene(options);
  const AdjustmentResult result = adjust_network(exact.network, {});
  ASSERT_EQ(result.status, AdjustmentStatus::ok) << result.reason;
  EXPECT_LT(largest_error_mm(exact, result), 1e-7);
  double rig = 0;
  double alone = 0;
  double normalised = 0;
  constexpr int kSeeds = 4;
  options.noise_px = 0.01;
  options.markers_per_body = 6;
  options.num_epochs = 7;
  for (int seed = 0; seed < kSeeds; ++seed) {
    options.seed = static_cast<unsigned>(70 + seed);
    ObservationScene scene = make_observation_scene(options);
    const AdjustmentResult on_rig = adjust_network(scene.network, {});
    ASSERT_EQ(on_rig.status, AdjustmentStatus::ok) << on_rig.reason;
    rig += mean_position_sigma_mm(scene, on_rig);
    normalised += mean_normalised_square(scene, on_rig) / kSeeds;
    scene.network.stations.clear();
    for (NetworkPhoto& photo : scene.network.photos) photo.station = -1;
    alone += mean_position_sigma_mm(scene, adjust_network(scene.network, {}));
  }
  EXPECT_LT(rig / alone, 0.75);
  EXPECT_GT(rig / alone, 0.3);
  EXPECT_GT(normalised, 0.7);
  EXPECT_LT(normalised, 1.4);
}

TEST(Network, HeldStationsHoldTheWorld) {
  ObservationSceneOptions options;
  options.fixed_stations = true;
  options.num_epochs = 3;
  ObservationScene scene = make_observation_scene(options);
  for (std::size_t s = 0; s < scene.network.stations.size(); ++s)
    scene.network.stations[s].camera_from_reference = scene.camera_from_fixed[s];
  const AdjustmentResult result = adjust_network(scene.network, {});
  ASSERT_EQ(result.status, AdjustmentStatus::ok) << result.reason;
  for (std::size_t f = 0; f < scene.network.features.size(); ++f) {
    if (scene.network.features[f].body != kReferenceBody) continue;
    EXPECT_LT(perturbation_between(scene.body_from_marker[f], result.geometry.body_from_feature[f]).norm(),
              1e-7);
  }
}

TEST(Network, SinglePointsAndAFewSquares) {
  ObservationSceneOptions options;
  options.markers_per_body = 2;
  options.points_per_body = 20;
  options.num_epochs = 5;
  const ObservationScene exact = make_observation_scene(options);
  const AdjustmentResult result = adjust_network(exact.network, {});
  ASSERT_EQ(result.status, AdjustmentStatus::ok) << result.reason;
  EXPECT_LT(largest_error_mm(exact, result), 1e-7);
  // The points carry the poses: without them the sigmas are larger, and a point that moved is found.
  options.noise_px = 0.01;
  ObservationScene scene = make_observation_scene(options);
  const AdjustmentResult with_points = adjust_network(scene.network, {});
  EXPECT_NEAR(with_points.sigma0, 1.0, 0.1);
  ObservationScene moved = scene;
  for (Observation& seen : moved.network.photos[7].observations) {
    if (seen.id == 110) seen.px.x() += 0.5;
  }
  EXPECT_EQ(adjust_network(moved.network, {}).photo_residuals[7].rejected, 1);
  for (NetworkPhoto& photo : scene.network.photos)
    std::erase_if(photo.observations, [](const Observation& seen) { return seen.px.size() == 2; });
  const AdjustmentResult without = adjust_network(scene.network, {});
  ASSERT_EQ(without.status, AdjustmentStatus::ok) << without.reason;
  EXPECT_LT(mean_position_sigma_mm(scene, with_points), 0.7 * mean_position_sigma_mm(scene, without));
}

constexpr int kSheetBody = 2;

// Photographs of a sheet of 24 squares, drawn exactly, with the campaign's camera: the sheet is a body, every
// photograph an epoch, and the station is held, because nothing but the sheet is seen.
void add_sheet_photographs(ObservationScene& scene, int count, double noise_px) {
  std::mt19937_64 rng(17);
  std::normal_distribution<double> normal(0.0, 1.0);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Network& network = scene.network;
  network.num_bodies = kSheetBody + 1;
  network.stations.push_back({Rigid3()});
  const std::size_t first = network.features.size();
  for (int i = 0; i < 24; ++i) {
    const int square = network.add_square(500 + i, kSheetBody, 30);
    NetworkFeature& feature = network.features[static_cast<std::size_t>(square)];
    feature.body_from_feature = Rigid3::from_translation({40.0 * (i % 6) - 100, 40.0 * (i / 6) - 60, 0});
    feature.modes.clear();  // a known sheet
    feature.print_scaled = false;
  }
  for (int k = 0; k < count; ++k) {
    const Rigid3 facing(quaternion_from_rotation_vector({std::numbers::pi, 0, 0}), Eigen::Vector3d::Zero());
    const Rigid3 camera_from_sheet =
        Rigid3(
            quaternion_from_rotation_vector(0.5 * Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng))),
            Eigen::Vector3d(30 * uniform(rng), 20 * uniform(rng), 600 + 60 * uniform(rng))) *
        facing;
    NetworkPhoto photo;
    photo.epoch = network.num_epochs++;
    photo.station = static_cast<int>(network.stations.size()) - 1;
    for (std::size_t f = first; f < network.features.size(); ++f) {
      Vector8d px;
      EXPECT_TRUE(project_drawn(
          {scene.true_camera, Rigid3(), &camera_from_sheet, *network.features[f].body_from_feature},
          network.features[f], px, nullptr));
      bool inside = true;
      for (int c = 0; c < 4; ++c) inside = inside && scene.true_camera.contains(px.segment<2>(2 * c), 10);
      if (!inside) continue;
      for (int i = 0; i < 8; ++i) px[i] += noise_px * normal(rng);
      const double stated = std::max(noise_px, 0.01);
      photo.observations.push_back(
          {network.features[f].id, true, px, stated * stated * Matrix8d::Identity()});
    }
    network.photos.push_back(photo);
  }
}

TEST(Network, SheetAndCampaignInOneAdjustmentCalibrateTheCameraInTheField) {
  ObservationSceneOptions options;
  options.num_epochs = 4;
  ObservationScene exact = make_observation_scene(options);
  add_sheet_photographs(exact, 6, 0);
  const AdjustmentResult result = adjust_network(exact.network, {});
  ASSERT_EQ(result.status, AdjustmentStatus::ok) << result.reason;
  EXPECT_LT(result.rms_px, 1e-7);
  EXPECT_LT(pose_errors(exact, result).rms_um, 1e-4);

  // A camera that is known ten times worse: alone, the poses suffer; with the sheet in the same adjustment
  // they are as good as their sigmas say, and better.
  options.noise_px = 0.01;
  options.interior_sigma = 1;
  double normalised = 0;
  double alone = 0;
  double together = 0;
  constexpr int kSeeds = 6;
  for (int seed = 0; seed < kSeeds; ++seed) {
    options.seed = static_cast<unsigned>(90 + seed);
    ObservationScene scene = make_observation_scene(options);
    NetworkCamera& camera = scene.network.cameras[0];
    camera.model.parameters =
        scene.true_camera.parameters + 10 * (camera.model.parameters - scene.true_camera.parameters);
    camera.covariance *= 100;
    alone += pose_errors(scene, adjust_network(scene.network, {})).rms_um;
    add_sheet_photographs(scene, 8, options.noise_px);
    const AdjustmentResult both = adjust_network(scene.network, {});
    ASSERT_EQ(both.status, AdjustmentStatus::ok) << both.reason;
    EXPECT_NEAR(both.sigma0, 1.0, 0.1);
    together += pose_errors(scene, both).rms_um;
    normalised += mean_normalised_square(scene, both) / kSeeds;
  }
  EXPECT_LT(together, alone);
  EXPECT_GT(normalised, 0.6);
  EXPECT_LT(normalised, 1.5);
}

}  // namespace
}  // namespace hexcal
