#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "kinematics/geometry/covariance.h"
#include "photogrammetry/adjustment/adjustment.h"
#include "tests/support/observation_scene.h"

// How far an adjustment is from the scene that its observations were made of.

namespace hexcal {

// The fixed body's true frame from the adjustment's: the best fit over all fixed corners.
inline Rigid3 true_from_adjusted(const ObservationScene& scene, const AdjustmentResult& result) {
  Eigen::Matrix3Xd from(3, 0);
  Eigen::Matrix3Xd to(3, 0);
  for (std::size_t m = 0; m < scene.network.features.size(); ++m) {
    if (scene.network.features[m].body != kReferenceBody || !result.geometry.has_feature[m]) continue;
    const auto adjusted = feature_points_in_body(scene.network, result.geometry, static_cast<int>(m));
    for (int c = 0; c < 4; ++c) {
      from.conservativeResize(3, from.cols() + 1);
      to.conservativeResize(3, to.cols() + 1);
      from.rightCols<1>() = adjusted.col(c);
      to.rightCols<1>() = scene.body_from_marker[m] * scene.printed_points(m).col(c);
    }
  }
  const Eigen::Matrix4d t = Eigen::umeyama(from, to, false);
  return {Eigen::Matrix3d(t.topLeftCorner<3, 3>()), t.topRightCorner<3, 1>()};
}

struct PoseErrors {
  double rms_um = 0, rms_mdeg = 0;
};

// 3D rms of the motions from home to each pose, in true axes: free of the gauge of both bodies.
inline PoseErrors pose_errors(const ObservationScene& scene, const AdjustmentResult& result) {
  const Rigid3 to_true = true_from_adjusted(scene, result);
  const std::vector<Rigid3>& found_from_moving = result.geometry.reference_from_body[kMovingBody];
  double mm2 = 0;
  double rad2 = 0;
  double count = 0;
  for (std::size_t e = 1; e < scene.fixed_from_moving.size(); ++e) {
    if (!result.geometry.has_pose[kMovingBody][e]) continue;
    const Rigid3 found = to_true * found_from_moving[e] * inverse(found_from_moving[0]) * inverse(to_true) *
                         scene.fixed_from_moving[0];
    const Vector6d delta = perturbation_between(scene.fixed_from_moving[e], found);
    mm2 += delta.head<3>().squaredNorm();
    rad2 += delta.tail<3>().squaredNorm();
    count += 1;
  }
  return {std::sqrt(mm2 / count) * 1e3, std::sqrt(rad2 / count) * kDegPerRad * 1e3};
}

// From a body's true frame to the adjustment's. That is by definition the frame of one of its markers, which
// has no error; it is the same piece of paper in both, whatever the scale came out as.
inline Rigid3 adjusted_from_true_body(const ObservationScene& scene, const AdjustmentResult& result,
                                      int body) {
  for (std::size_t f = 0; f < scene.network.features.size(); ++f) {
    if (scene.network.features[f].body != body || !result.geometry.has_feature[f]) continue;
    if (result.body_from_feature(static_cast<int>(f)).by_error.norm() > 0) continue;
    return result.geometry.body_from_feature[f] * inverse(scene.body_from_marker[f]);
  }
  ADD_FAILURE() << "no marker holds the frame of body " << body;
  return {};
}

// Normalised squares (per degree of freedom) of the error of each epoch's motion relative to the home epoch,
// expressed in the adjustment's own frame, where the covariance is known.
inline double mean_normalised_square(const ObservationScene& scene, const AdjustmentResult& result) {
  const Rigid3 adjusted_from_true_moving = adjusted_from_true_body(scene, result, kMovingBody);
  double sum = 0;
  int count = 0;
  const Rigid3& home = result.geometry.reference_from_body[kMovingBody][0];
  for (std::size_t e = 1; e < scene.fixed_from_moving.size(); ++e) {
    const Rigid3& pose = result.geometry.reference_from_body[kMovingBody][e];
    const Rigid3 found = inverse(home) * pose;
    const Rigid3 truth = adjusted_from_true_moving * inverse(scene.fixed_from_moving[0]) *
                         scene.fixed_from_moving[e] * inverse(adjusted_from_true_moving);
    const Vector6d delta = perturbation_between(truth, found);
    const Matrix6d jh = product_jacobian_left(inverse(home), pose) * inverse_jacobian(home);
    const Matrix6d je = product_jacobian_right(inverse(home), pose);
    const int i = static_cast<int>(e);
    const Matrix6d cross = jh * result.pose_covariance(0, i) * je.transpose();
    const Matrix6d covariance = jh * result.pose_covariance(0, 0) * jh.transpose() +
                                je * result.pose_covariance(i, i) * je.transpose() + cross +
                                cross.transpose();
    for (int k = 0; k < 6; ++k) {
      sum += delta[k] * delta[k] / covariance(k, k);
      ++count;
    }
  }
  return sum / count;
}

}  // namespace hexcal
