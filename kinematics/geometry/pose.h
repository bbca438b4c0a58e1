#pragma once

#include <Eigen/Core>
#include <numbers>

#include "kinematics/geometry/rigid3.h"

namespace hexcal {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

inline constexpr double kRadPerDeg = std::numbers::pi / 180.0;
inline constexpr double kDegPerRad = 180.0 / std::numbers::pi;

/// R = Rz(yaw) * Ry(pitch) * Rx(roll); rpy = (roll, pitch, yaw) in rad.
[[nodiscard]] Eigen::Quaterniond quaternion_from_rpy(const Eigen::Vector3d& rpy_rad);

/// Inverse of quaternion_from_rpy: roll and yaw in (-pi, pi], pitch in [-pi/2, pi/2]. At pitch = +-90 deg,
/// where only a sum of roll and yaw is determined, roll is set to zero.
[[nodiscard]] Eigen::Vector3d rpy_from_quaternion(const Eigen::Quaterniond& q);

/// Angle wrapped to (-pi, pi] rad.
[[nodiscard]] double wrap_angle(double angle_rad);

/// A pose of the lower grip relative to its home, in home axes: x, y, z in mm, roll, pitch, yaw in rad
/// (CONVENTIONS.md).
struct Pose {
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d rpy_rad = Eigen::Vector3d::Zero();

  [[nodiscard]] Vector6d vector() const {
    Vector6d v;
    v << position_mm, rpy_rad;
    return v;
  }
  [[nodiscard]] static Pose from_vector(const Vector6d& v) { return {v.head<3>(), v.tail<3>()}; }
};

/// The same pose with each angle in (-pi, pi].
[[nodiscard]] Pose wrapped(Pose pose);

/// home_from_LG = Trans(x, y, z) * R, the pose as a rigid motion.
[[nodiscard]] Rigid3 home_from_lg(const Pose& pose);
[[nodiscard]] Pose pose_from_home_from_lg(const Rigid3& home_from_LG);

/// UG_from_LG = Trans(0, 0, -gd) * Trans(x, y, z) * R.
[[nodiscard]] Rigid3 ug_from_lg(const Pose& pose, double gd_mm);
[[nodiscard]] Pose pose_from_ug_from_lg(const Rigid3& UG_from_LG, double gd_mm);

/// Angle by which the z axis of the lower grip turns away from where it points at home, 0 to pi; turning
/// about z is no tilt.
[[nodiscard]] double tilt_rad(const Pose& pose);

/// Error of a pose = actual minus target per parameter, angles wrapped to +-pi.
[[nodiscard]] Vector6d pose_error(const Pose& actual, const Pose& target);

}  // namespace hexcal
