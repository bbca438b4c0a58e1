#pragma once

#include <Eigen/Cholesky>
#include <random>
#include <vector>

#include "kinematics/geometry/covariance.h"
#include "kinematics/geometry/pose.h"
#include "photogrammetry/adjustment/network.h"
#include "photogrammetry/adjustment/projection.h"

namespace hexcal {

/// Marker observations of two grips without images: ten markers on differently oriented faces of each, three
/// camera stations per pose at 0.7 m. Everything follows from the seed.
struct ObservationSceneOptions {
  int num_epochs = 13;
  int stations = 3;
  int markers_per_body = 10;
  int points_per_body = 0;  ///< single points beside the markers
  int moving_bodies = 1;    ///< 2: another grip, below the first, with poses of its own
  bool fixed_stations =
      false;  ///< every pose is photographed from the same stations, and the network knows it
  double size_mm = 24;
  double noise_px = 0;         ///< standard deviation of a corner coordinate
  double stated_noise_px = 0;  ///< what the covariances claim; 0: noise_px, or 0.01 px without noise
  double interior_sigma =
      0;  ///< 1: the camera given differs from the true one by the calibration's covariance
  double shape_sigma_mm = 0;  ///< squareness and flatness of the printed markers
  double size_sigma = 0;      ///< relative, of each printed marker's own size
  double print_scale = 0;
  unsigned seed = 1;
};

struct ObservationScene {
  Network network;
  CameraModel true_camera;
  std::vector<Rigid3> fixed_from_moving, camera_from_fixed, body_from_marker;
  std::vector<Rigid3> fixed_from_second;  ///< of a second moving body
  double print_scale = 0;
  Eigen::VectorXd shape;  ///< per shape parameter of the network

  /// True points of a feature in its own frame.
  [[nodiscard]] DrawnPoints printed_points(std::size_t feature) const {
    NetworkGeometry truth;
    truth.shape = shape;
    truth.print_scale = print_scale;
    return hexcal::printed_points(network.features[feature], truth);
  }
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
  scene.print_scale = options.print_scale;
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

  // Faces around the front half of drums, the fixed one above the moving ones; z up, cameras at +x.
  scene.network.num_bodies = 1 + options.moving_bodies;
  for (int body = 0; body < scene.network.num_bodies; ++body) {
    for (int i = 0; i < options.markers_per_body + options.points_per_body; ++i) {
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
      const double height = (body == 0 ? 1 : -1) * (35.0 + 30.0 * (i / 5 % 2)) + (body == 0 ? 0 : 50);
      Eigen::Vector3d at(60 * outward.x(), 60 * outward.y(), height);
      Vector6d jitter;
      jitter << 1.5 * normals(3), 0.03 * normals(3);
      if (i >= options.markers_per_body) at += 8 * Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng));
      scene.body_from_marker.push_back(perturbed(Rigid3(r, at), jitter));
      const int id = 100 * body + i;
      if (i >= options.markers_per_body) {
        (void)scene.network.add_point(id, body);
        continue;
      }
      Eigen::VectorXd shape = options.shape_sigma_mm / (0.5 * options.size_mm) * normals(kSquareModes);
      if (options.size_sigma > 0) shape[kSquareSize] += options.size_sigma * normal(rng);
      scene.shape.conservativeResize(scene.shape.size() + kSquareModes);
      scene.shape.tail<kSquareModes>() = shape;
      (void)scene.network.add_square(id, body, options.size_mm);
    }
  }
  if (options.fixed_stations) scene.network.stations.resize(static_cast<std::size_t>(options.stations));
  for (int e = 0; e < options.num_epochs; ++e) {
    Pose pose;
    if (e > 0) {
      pose.position_mm = 10 * Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng));
      pose.rpy_rad = 5 * kRadPerDeg * Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng));
    }
    scene.fixed_from_moving.push_back(ug_from_lg(pose, 50.0));
    if (options.moving_bodies > 1) {
      const Rigid3 below(
          quaternion_from_rotation_vector(0.1 * Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng))),
          Eigen::Vector3d(10 * uniform(rng), 10 * uniform(rng), -115 + 3 * uniform(rng)));
      scene.fixed_from_second.push_back(below);
    }
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
      Rigid3 camera_from_fixed = inverse(Rigid3(
          fixed_camera * quaternion_from_rotation_vector({0, 0, 0.5 * uniform(rng)}).toRotationMatrix(),
          eye));
      if (options.fixed_stations && e > 0)
        camera_from_fixed = scene.camera_from_fixed[static_cast<std::size_t>(s)];
      scene.camera_from_fixed.push_back(camera_from_fixed);
      NetworkPhoto photo;
      photo.epoch = e;
      if (options.fixed_stations) photo.station = s;
      for (std::size_t m = 0; m < scene.network.features.size(); ++m) {
        const NetworkFeature& marker = scene.network.features[m];
        const auto epoch = static_cast<std::size_t>(e);
        const Rigid3* motion = marker.body == kReferenceBody ? nullptr
                               : marker.body == kMovingBody  ? &scene.fixed_from_moving[epoch]
                                                             : &scene.fixed_from_second[epoch];
        const Rigid3 fixed_from_marker =
            motion != nullptr ? *motion * scene.body_from_marker[m] : scene.body_from_marker[m];
        const Rigid3 camera_from_marker = camera_from_fixed * fixed_from_marker;
        const double facing =
            -camera_from_marker.rotation_matrix().col(2).dot(camera_from_marker.translation.normalized());
        Vector8d px;
        const bool visible =
            project_feature({camera, camera_from_fixed, motion, scene.body_from_marker[m]}, marker,
                            scene.printed_points(m), options.print_scale, px, nullptr);
        if (!visible || facing < 0.3) continue;
        bool inside = true;
        const Eigen::Index rows = 2 * marker.points();
        for (Eigen::Index i = 0; i < rows; i += 2) inside = inside && camera.contains(px.segment<2>(i), 10);
        if (!inside) continue;
        Observation seen;
        seen.id = marker.id;
        const double stated = options.stated_noise_px > 0 ? options.stated_noise_px
                              : options.noise_px > 0      ? options.noise_px
                                                          : 0.01;
        px += options.noise_px * normals(8);
        seen.px = px.head(rows);
        seen.covariance_px2 = stated * stated * Eigen::MatrixXd::Identity(rows, rows);
        photo.observations.push_back(seen);
      }
      scene.network.photos.push_back(photo);
    }
  }
  return scene;
}

}  // namespace hexcal
