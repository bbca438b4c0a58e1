#include <cmath>

#include "kinematics/geometry/covariance.h"
#include "pose_extract/datum_frame.h"

namespace hexcal {
namespace {

constexpr double kStepOfMeans = 1e-4;  // mm, and of directions
constexpr double kLeastFacing = 0.2;   // mean of the markers' normals, across z
constexpr double kLeastSine = 0.17;    // of the angle between z and the side that the markers face

// What the frame is made of, each with its derivative by the errors of the adjustment.
struct MarkerMeans {
  Eigen::Vector3d fixed, facing, moving;  // in the reference body; of `moving` at home
  Eigen::Matrix3Xd fixed_by_error, facing_by_error, moving_by_error;
  Eigen::Matrix3d moving_own = Eigen::Matrix3d::Zero();  // covariance by the home epoch's own noise
};

struct BodyMean {
  int count = 0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3Xd by_error;
};

BodyMean mean_of_centres(const Network& network, const AdjustmentResult& adjusted, int body) {
  BodyMean mean;
  mean.by_error = Eigen::Matrix3Xd::Zero(3, adjusted.num_errors());
  for (std::size_t m = 0; m < network.features.size(); ++m) {
    if (network.features[m].body != body || !adjusted.geometry.has_feature[m]) continue;
    const EstimatedPoint point = adjusted.point(static_cast<int>(m));
    mean.centre += point.in_body;
    mean.by_error += point.by_error;
    ++mean.count;
  }
  if (mean.count > 0) {
    mean.centre /= mean.count;
    mean.by_error /= mean.count;
  }
  return mean;
}

// The mean of the normals of the fixed markers, or the first one's if they face all around or along z.
void take_facing(const Network& network, const AdjustmentResult& adjusted, MarkerMeans& means) {
  const Eigen::Vector3d z = (means.fixed - means.moving).normalized();
  const auto across = [&z](const Eigen::Vector3d& v) { return (v - v.dot(z) * z).norm(); };
  means.facing.setZero();
  means.facing_by_error = Eigen::Matrix3Xd::Zero(3, adjusted.num_errors());
  int count = 0;
  Eigen::Vector3d first_normal = Eigen::Vector3d::Zero();
  Eigen::Matrix3Xd first_by_error;
  for (std::size_t m = 0; m < network.features.size(); ++m) {
    if (network.features[m].body != kReferenceBody || !adjusted.geometry.has_feature[m]) continue;
    const EstimatedMotion marker = adjusted.body_from_feature(static_cast<int>(m));
    const Eigen::Matrix3d axes = marker.motion.rotation_matrix();
    const Eigen::Matrix3Xd turned = marker.by_error.bottomRows<3>();
    for (const int axis : {2, 0}) {  // a marker that faces along z still has a side
      if (first_normal.isZero() && across(axes.col(axis)) > kLeastSine) {
        first_normal = axes.col(axis);
        first_by_error = -skew(first_normal) * turned;
      }
    }
    means.facing += axes.col(2);
    means.facing_by_error -= skew(axes.col(2)) * turned;
    ++count;
  }
  if (across(means.facing) < kLeastFacing * count) {
    means.facing = first_normal;
    means.facing_by_error = first_by_error;
  }
}

Rigid3 frame_of(const Eigen::Vector3d& fixed, const Eigen::Vector3d& facing, const Eigen::Vector3d& moving) {
  Eigen::Matrix3d axes;
  axes.col(2) = (fixed - moving).normalized();
  axes.col(1) = -(facing - facing.dot(axes.col(2)) * axes.col(2)).normalized();
  axes.col(0) = axes.col(1).cross(axes.col(2));
  return inverse(Rigid3(axes, fixed));
}

}  // namespace

DatumFrame frame_from_markers(const Network& network, const AdjustmentResult& adjusted, int home_epoch,
                              const Rigid3& markers_from_frame) {
  DatumFrame frame;
  if (home_epoch < 0 || !adjusted.geometry.has_pose[kMovingBody][static_cast<std::size_t>(home_epoch)]) {
    frame.reason = "it is from the markers at home, and the home pose was not measured";
    return frame;
  }
  const BodyMean fixed = mean_of_centres(network, adjusted, kReferenceBody);
  const BodyMean moving = mean_of_centres(network, adjusted, kMovingBody);
  if (fixed.count == 0 || moving.count == 0) {
    frame.reason = "markers of one body were not measured";
    return frame;
  }
  const EstimatedMotion home = adjusted.reference_from_body(home_epoch);
  const Eigen::Matrix3d turn = home.motion.rotation_matrix();
  Eigen::Matrix<double, 3, 6> by_home;
  by_home << Eigen::Matrix3d::Identity(), -skew(turn * moving.centre);
  MarkerMeans means{fixed.centre, {}, home.motion * moving.centre, fixed.by_error, {}, {}};
  means.moving_by_error = by_home * home.by_error + turn * moving.by_error;
  means.moving_own = by_home * home.own * by_home.transpose();
  const double apart_mm = (means.fixed - means.moving).norm();
  if (apart_mm < 1e-3) {
    frame.reason = "the fixed and the moving markers have one middle at home: no direction of z";
    return frame;
  }
  take_facing(network, adjusted, means);
  frame.frame_from_body = frame_of(means.fixed, means.facing, means.moving);
  frame.by_error = Eigen::Matrix<double, 7, Eigen::Dynamic>::Zero(7, adjusted.num_errors());
  Eigen::Vector3d* const parts[] = {&means.fixed, &means.facing, &means.moving};
  const Eigen::Matrix3Xd* const errors[] = {&means.fixed_by_error, &means.facing_by_error,
                                            &means.moving_by_error};
  for (int part = 0; part < 3; ++part) {
    Eigen::Matrix<double, 6, 3> by_part;
    for (int axis = 0; axis < 3; ++axis) {
      double& value = (*parts[part])[axis];
      const double kept = value;
      value = kept + kStepOfMeans;
      const Rigid3 plus = frame_of(means.fixed, means.facing, means.moving);
      value = kept - kStepOfMeans;
      const Rigid3 minus = frame_of(means.fixed, means.facing, means.moving);
      value = kept;
      by_part.col(axis) = perturbation_between(minus, plus) / (2 * kStepOfMeans);
    }
    frame.by_error.topRows<6>() += by_part * *errors[part];
    if (part == 2) frame.own.topLeftCorner<6, 6>() = by_part * means.moving_own * by_part.transpose();
  }
  const Rigid3 turned = inverse(markers_from_frame);
  const Matrix6d by_markers = product_jacobian_right(turned, frame.frame_from_body);
  frame.frame_from_body = turned * frame.frame_from_body;
  frame.by_error.topRows<6>() = (by_markers * frame.by_error.topRows<6>()).eval();
  frame.own.topLeftCorner<6, 6>() =
      (by_markers * frame.own.topLeftCorner<6, 6>() * by_markers.transpose()).eval();
  frame.ok = true;
  frame.reason.clear();
  return frame;
}

}  // namespace hexcal
