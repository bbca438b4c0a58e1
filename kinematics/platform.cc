#include "kinematics/platform.h"

#include <Eigen/SVD>
#include <cmath>

namespace hexcal {

Rigid3 PlatformGeometry::B_from_P(const Pose& pose) const {
  return B_from_UG * ug_from_lg(pose, gd_mm) * inverse(P_from_LG);
}

Pose PlatformGeometry::pose_from_B_from_P(const Rigid3& B_from_P_motion) const {
  return pose_from_ug_from_lg(inverse(B_from_UG) * B_from_P_motion * P_from_LG, gd_mm);
}

LegVector leg_lengths(const PlatformGeometry& geometry, const Rigid3& B_from_P) {
  LegVector lengths;
  for (std::size_t i = 0; i < 6; ++i) {
    lengths[static_cast<Eigen::Index>(i)] =
        (B_from_P * geometry.platform_joints_mm[i] - geometry.base_joints_mm[i]).norm();
  }
  return lengths;
}

Matrix6d leg_jacobian(const PlatformGeometry& geometry, const Rigid3& B_from_P) {
  Matrix6d j;
  for (std::size_t i = 0; i < 6; ++i) {
    const Eigen::Vector3d arm = B_from_P.rotation * geometry.platform_joints_mm[i];
    const Eigen::Vector3d u = (arm + B_from_P.translation - geometry.base_joints_mm[i]).normalized();
    j.row(static_cast<Eigen::Index>(i)) << u.transpose(), arm.cross(u).transpose();
  }
  return j;
}

LegVector readings_from_lengths(const PlatformGeometry& geometry, const LegVector& lengths_mm) {
  LegVector q;
  for (std::size_t i = 0; i < 6; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    q[k] = (lengths_mm[k] - geometry.actuators[i].offset_mm) / geometry.actuators[i].mm_per_unit;
  }
  return q;
}

LegVector lengths_from_readings(const PlatformGeometry& geometry, const LegVector& readings) {
  LegVector lengths;
  for (std::size_t i = 0; i < 6; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    lengths[k] = geometry.actuators[i].offset_mm + geometry.actuators[i].mm_per_unit * readings[k];
  }
  return lengths;
}

Eigen::Vector3d platform_centroid_mm(const PlatformGeometry& geometry) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& joint : geometry.platform_joints_mm) sum += joint;
  return sum / 6;
}

double characteristic_length_mm(const PlatformGeometry& geometry) {
  const Eigen::Vector3d centroid = platform_centroid_mm(geometry);
  double sum = 0;
  for (const Eigen::Vector3d& joint : geometry.platform_joints_mm) sum += (joint - centroid).squaredNorm();
  return std::sqrt(sum / 6);
}

}  // namespace hexcal
