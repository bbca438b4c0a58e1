#include "kinematics/geometry/pose.h"

#include <cmath>

namespace hexcal {

Eigen::Quaterniond quaternion_from_rpy(const Eigen::Vector3d& rpy_rad) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(rpy_rad.z(), Eigen::Vector3d::UnitZ()) *
                            Eigen::AngleAxisd(rpy_rad.y(), Eigen::Vector3d::UnitY()) *
                            Eigen::AngleAxisd(rpy_rad.x(), Eigen::Vector3d::UnitX()));
}

Eigen::Vector3d rpy_from_quaternion(const Eigen::Quaterniond& q) {
  const Eigen::Matrix3d r = q.toRotationMatrix();
  const double cos_pitch = std::hypot(r(0, 0), r(1, 0));
  const double pitch = std::atan2(-r(2, 0), cos_pitch);
  if (cos_pitch < 1e-12) {
    return {0.0, pitch, std::atan2(-r(0, 1), r(1, 1))};
  }
  return {std::atan2(r(2, 1), r(2, 2)), pitch, std::atan2(r(1, 0), r(0, 0))};
}

double wrap_angle(double angle_rad) { return std::remainder(angle_rad, 360.0 * kRadPerDeg); }

Pose wrapped(Pose pose) {
  for (double& angle : pose.rpy_rad) angle = wrap_angle(angle);
  return pose;
}

Rigid3 home_from_lg(const Pose& pose) { return {quaternion_from_rpy(pose.rpy_rad), pose.position_mm}; }

double tilt_rad(const Pose& pose) {
  const Eigen::Vector3d z = quaternion_from_rpy(pose.rpy_rad) * Eigen::Vector3d::UnitZ();
  return std::atan2(z.head<2>().norm(), z.z());
}

Pose pose_from_home_from_lg(const Rigid3& home_from_LG) {
  return {home_from_LG.translation, rpy_from_quaternion(home_from_LG.rotation)};
}

Rigid3 ug_from_lg(const Pose& pose, double gd_mm) {
  return Rigid3::from_translation({0, 0, -gd_mm}) * home_from_lg(pose);
}

Pose pose_from_ug_from_lg(const Rigid3& UG_from_LG, double gd_mm) {
  return pose_from_home_from_lg(Rigid3::from_translation({0, 0, gd_mm}) * UG_from_LG);
}

Vector6d pose_error(const Pose& actual, const Pose& target) {
  constexpr double kHalfTurn = 180.0 * kRadPerDeg;
  const auto difference = [&target](const Eigen::Vector3d& rpy_rad) {
    Eigen::Vector3d error = rpy_rad - target.rpy_rad;
    for (double& angle : error) angle = wrap_angle(angle);
    return error;
  };
  const Eigen::Vector3d& rpy = actual.rpy_rad;
  const Eigen::Vector3d stated = difference(rpy);
  const Eigen::Vector3d other = difference({rpy.x() + kHalfTurn, kHalfTurn - rpy.y(), rpy.z() + kHalfTurn});
  Vector6d error;
  error << actual.position_mm - target.position_mm, other.norm() < stated.norm() ? other : stated;
  return error;
}

}  // namespace hexcal
