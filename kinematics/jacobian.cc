#include "kinematics/jacobian.h"

#include <Eigen/LU>

#include "kinematics/screw.h"

namespace hexcal {

ReadingJacobians reading_jacobians(const PlatformGeometry& geometry, const Rigid3& B_from_P) {
  constexpr double kTwoPi = 6.283185307179586;
  ReadingJacobians j;
  j.readings = readings_from_lengths(geometry, actuated_lengths(geometry, B_from_P));
  j.by_pose = actuated_jacobian(geometry, B_from_P);
  const Eigen::Matrix3d P_from_B = B_from_P.rotation_matrix().transpose();
  for (std::size_t i = 0; i < 6; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const Eigen::Vector3d d = B_from_P * geometry.platform_joints_mm[i] - geometry.base_joints_mm[i];
    const Eigen::Vector3d u = d.normalized();
    Eigen::Vector3d by_joint = u;  // actuated length by the platform joint's place in B
    double by_lead = 0;
    if (geometry.screw) {
      const Twist twist =
          leg_twist(u, geometry.screw->base_axes[i], B_from_P.rotation * geometry.screw->platform_axes[i]);
      by_joint += geometry.screw->lead_mm / kTwoPi * (twist.by_u - u * u.dot(twist.by_u)) / d.norm();
      by_lead = twist.angle_rad / kTwoPi;
    }
    const double per_mm = 1 / geometry.actuators[i].mm_per_unit;
    j.by_pose.row(k) *= per_mm;
    j.by_base.row(k) = -per_mm * by_joint.transpose();
    j.by_platform.row(k) = per_mm * (P_from_B * by_joint).transpose();
    j.by_offset[k] = -per_mm;
    j.by_scale[k] = -per_mm * j.readings[k];
    j.by_lead[k] = per_mm * by_lead;
  }
  return j;
}

PoseJacobians pose_jacobians(const PlatformGeometry& geometry, const Rigid3& B_from_P) {
  const ReadingJacobians r = reading_jacobians(geometry, B_from_P);
  PoseJacobians p;
  p.by_readings = r.by_pose.inverse();
  for (Eigen::Index k = 0; k < 6; ++k) {
    p.by_base.middleCols<3>(3 * k) = -p.by_readings.col(k) * r.by_base.row(k);
    p.by_platform.middleCols<3>(3 * k) = -p.by_readings.col(k) * r.by_platform.row(k);
    p.by_offset.col(k) = -p.by_readings.col(k) * r.by_offset[k];
    p.by_scale.col(k) = -p.by_readings.col(k) * r.by_scale[k];
  }
  p.by_lead = -p.by_readings * r.by_lead;
  return p;
}

}  // namespace hexcal
