#pragma once

#include <Eigen/Cholesky>
#include <random>
#include <vector>

#include "kinematics/geometry/covariance.h"
#include "kinematics/geometry/pose.h"
#include "photogrammetry/adjustment/network.h"
#include "photogrammetry/adjustment/sighting.h"

namespace hexcal {

/// Marker observations of two grips without images: ten markers on differently oriented faces of each, three
/// camera stations per pose at 0.7 m. Everything follows from the seed.
struct ObservationSceneOptions {
  int num_epochs = 13;
  int stations = 3;
  int markers_per_body = 10;
  double size_mm = 24;
  double noise_px = 0;         ///< standard deviation of a corner coordinate
  double stated_noise_px = 0;  ///< what the covariances claim; 0: noise_px, or 0.01 px without noise
  double interior_sigma =
      0;  ///< 1: the camera given differs from the true one by the calibration's covariance
  double shape_sigma_mm = 0;  ///< squareness and flatness of the printed markers
  double print_scale = 0;
  unsigned seed = 1;
};

struct ObservationScene {
  Network network;
  CameraModel true_camera;
  std::vector<Rigid3> fixed_from_moving, camera_from_fixed, body_from_marker;
  std::vector<SquareShape> shape_mm;
};

/// A calibration's covariance of typical size with f and k correlated.
inline Eigen::MatrixXd typical_interior_covariance() {
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(9, 9);
  a.diagonal() << 0.8, 2e-5, 0.6, 0.6, 2e-4, 4e-3, 1e-5, 1e-5, 2e-2;
  a(4, 0) = 1e-4;
  a(5, 4) = -3e-3;
  a(6, 3) = 5e-6;
  a(7, 2) = 5e-6;
  return a * a.transpose();
}

inline ObservationScene make_observation_scene(const ObservationSceneOptions& options) {
  std::mt19937_64 rng(options.seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto normals = [&](Eigen::Index n) {
    Eigen::VectorXd v(n);
    for (Eigen::Index i = 0; i < n; ++i) v[i] = normal(rng);
    return v;
  };
  ObservationScene scene;
  CameraModel camera(6016, 4000, 9011.0);
  camera.parameters.tail<5>() << 0.03, -0.05, 1e-4, -2e-4, 0.1;
  camera.parameters[2] += 13;
  camera.parameters[3] -= 9;
  scene.true_camera = camera;
  NetworkCamera given{camera, typical_interior_covariance()};
  if (options.interior_sigma > 0) {
    const Eigen::MatrixXd root = given.covariance.llt().matrixL();
    given.model.parameters += options.interior_sigma * root * normals(9);
  } else {
    given.covariance = Eigen::MatrixXd();
  }
  scene.network.cameras.push_back(given);
  scene.network.num_epochs = options.num_epochs;

  // Faces around the front half of two drums, the fixed one above the moving one; z up, cameras at +x.
  for (int body = 0; body < 2; ++body) {
    for (int i = 0; i < options.markers_per_body; ++i) {
      const int column = i % 5;
      const double azimuth = (column - 2) * 28.0 * kRadPerDeg;
      const double tilt = (i % 3 - 1) * 12.0 * kRadPerDeg;
      const Eigen::Vector3d outward(std::cos(azimuth) * std::cos(tilt), std::sin(azimuth) * std::cos(tilt),
                                    std::sin(tilt));
      const Eigen::Vector3d up(0, 0, 1);
      Eigen::Matrix3d r;
      r.col(0) = up.cross(outward).normalized();
      r.col(2) = outward;
      r.col(1) = outward.cross(r.col(0));
      const double height = (body == 0 ? 1 : -1) * (35.0 + 30.0 * (i / 5)) + (body == 0 ? 0 : 50);
      const Eigen::Vector3d at(60 * outward.x(), 60 * outward.y(), height);
      Vector6d jitter;
      jitter << 1.5 * normals(3), 0.03 * normals(3);
      scene.body_from_marker.push_back(perturbed(Rigid3(r, at), jitter));
      SquareShape shape = options.shape_sigma_mm * normals(6);
      scene.shape_mm.push_back(shape);
      scene.network.markers.push_back(
          {body == 0 ? i : 100 + i, body == 0 ? Body::fixed : Body::moving, options.size_mm});
    }
  }
  for (int e = 0; e < options.num_epochs; ++e) {
    Pose pose;
    if (e > 0) {
      pose.position_mm = 10 * Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng));
      pose.rpy_rad = 5 * kRadPerDeg * Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng));
    }
    scene.fixed_from_moving.push_back(ug_from_lg(pose, 50.0));
    for (int s = 0; s < options.stations; ++s) {
      const double azimuth = ((s % 3 - 1) * 30.0 + 3 * uniform(rng)) * kRadPerDeg;
      const double elevation = ((s % 2 == 0 ? 12.0 : -14.0) + 3 * uniform(rng)) * kRadPerDeg;
      const double distance = 700 + 20 * uniform(rng);
      const Eigen::Vector3d eye =
          distance * Eigen::Vector3d(std::cos(azimuth) * std::cos(elevation),
                                     std::sin(azimuth) * std::cos(elevation), std::sin(elevation));
      const Eigen::Vector3d target(0, 5 * uniform(rng), 5 * uniform(rng));
      Eigen::Matrix3d fixed_camera;
      fixed_camera.col(2) = (target - eye).normalized();
      fixed_camera.col(0) = fixed_camera.col(2).cross(Eigen::Vector3d::UnitZ()).normalized();
      fixed_camera.col(1) = fixed_camera.col(2).cross(fixed_camera.col(0));
      const Rigid3 camera_from_fixed = inverse(Rigid3(
          fixed_camera * quaternion_from_rotation_vector({0, 0, 0.5 * uniform(rng)}).toRotationMatrix(),
          eye));
      scene.camera_from_fixed.push_back(camera_from_fixed);
      NetworkPhoto photo;
      photo.epoch = e;
      for (std::size_t m = 0; m < scene.network.markers.size(); ++m) {
        const NetworkMarker& marker = scene.network.markers[m];
        const Rigid3* motion =
            marker.body == Body::moving ? &scene.fixed_from_moving[static_cast<std::size_t>(e)] : nullptr;
        const Rigid3 fixed_from_marker =
            motion != nullptr ? *motion * scene.body_from_marker[m] : scene.body_from_marker[m];
        const Rigid3 camera_from_marker = camera_from_fixed * fixed_from_marker;
        const double facing =
            -camera_from_marker.rotation_matrix().col(2).dot(camera_from_marker.translation.normalized());
        Vector8d px;
        const bool visible =
            project_marker({camera, camera_from_fixed, motion, scene.body_from_marker[m]}, marker.size_mm,
                           options.print_scale, scene.shape_mm[m], px, nullptr);
        if (!visible || facing < 0.3) continue;
        bool inside = true;
        for (int c = 0; c < 4; ++c) inside = inside && camera.contains(px.segment<2>(2 * c), 10);
        if (!inside) continue;
        MarkerObservation seen;
        seen.id = marker.id;
        seen.status = MarkerStatus::ok;
        const double stated = options.stated_noise_px > 0 ? options.stated_noise_px
                              : options.noise_px > 0      ? options.noise_px
                                                          : 0.01;
        px += options.noise_px * normals(8);
        for (int c = 0; c < 4; ++c) seen.corners_px[static_cast<std::size_t>(c)] = px.segment<2>(2 * c);
        seen.covariance_px2 *= stated * stated;
        seen.side_px = (px.segment<2>(2) - px.segment<2>(0)).norm();
        photo.markers.push_back(seen);
      }
      scene.network.photos.push_back(photo);
    }
  }
  return scene;
}

}  // namespace hexcal
