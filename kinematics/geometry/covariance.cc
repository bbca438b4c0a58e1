#include "kinematics/geometry/covariance.h"

#include <cmath>

namespace hexcal {

Rigid3 perturbed(const Rigid3& b_from_a, const Vector6d& delta) {
  return {quaternion_from_rotation_vector(delta.tail<3>()) * b_from_a.rotation,
          b_from_a.translation + delta.head<3>()};
}

Vector6d perturbation_between(const Rigid3& from, const Rigid3& to) {
  Vector6d delta;
  delta << to.translation - from.translation,
      rotation_vector_from_quaternion(to.rotation * from.rotation.conjugate());
  return delta;
}

Matrix6d product_jacobian_left(const Rigid3& c_from_b, const Rigid3& b_from_a) {
  // t = R_cb t_ba + t_cb with R_cb' = exp(dr) R_cb moves t by dr x (R_cb t_ba).
  Matrix6d j = Matrix6d::Identity();
  j.topRightCorner<3, 3>() = -skew(c_from_b.rotation * b_from_a.translation);
  return j;
}

Matrix6d product_jacobian_right(const Rigid3& c_from_b, const Rigid3& /*b_from_a*/) {
  Matrix6d j = Matrix6d::Zero();
  j.topLeftCorner<3, 3>() = c_from_b.rotation_matrix();
  j.bottomRightCorner<3, 3>() = c_from_b.rotation_matrix();
  return j;
}

Matrix6d inverse_jacobian(const Rigid3& b_from_a) {
  // R' = R^T exp(-dr) = exp(-R^T dr) R^T, t' = -R^T exp(-dr) (t + dt) = t_inv - R^T dt + R^T (dr x t).
  const Eigen::Matrix3d rt = b_from_a.rotation_matrix().transpose();
  Matrix6d j = Matrix6d::Zero();
  j.topLeftCorner<3, 3>() = -rt;
  j.topRightCorner<3, 3>() = -rt * skew(b_from_a.translation);
  j.bottomRightCorner<3, 3>() = -rt;
  return j;
}

Matrix6d pose_parameters_jacobian(const Pose& pose) {
  constexpr double kLeastCosine = 1e-7;
  const double sp = std::sin(pose.rpy_rad.y());
  const double cy = std::cos(pose.rpy_rad.z());
  const double sy = std::sin(pose.rpy_rad.z());
  double cp = std::cos(pose.rpy_rad.y());
  if (std::abs(cp) < kLeastCosine) cp = std::copysign(kLeastCosine, cp);
  // dr = (Rz Ry ex) droll + (Rz ey) dpitch + ez dyaw, solved for the rates.
  const Eigen::RowVector3d roll(cy / cp, sy / cp, 0);
  Matrix6d j = Matrix6d::Identity();
  j.block<1, 3>(3, 3) = roll;
  j.block<1, 3>(4, 3) << -sy, cy, 0;
  j.block<1, 3>(5, 3) = sp * roll + Eigen::RowVector3d::UnitZ();
  return j;
}

}  // namespace hexcal
