#pragma once

#include <array>
#include <optional>

#include "kinematics/geometry/pose.h"

namespace hexcal {

using LegVector = Vector6d;  ///< one number per leg, legs 0..5

/// One actuator. Its reading q maps to the leg's length, joint centre to joint centre: length = offset +
/// mm_per_unit q.
struct Actuator {
  double offset_mm = 0;
  double mm_per_unit = 1;
  double min_mm = 0;  ///< shortest leg
  double max_mm = 0;  ///< longest leg
};

struct JointLimits {
  double base_rad = 0;      ///< largest angle of a leg from its direction at home, at the base joint
  double platform_rad = 0;  ///< the same at the platform joint
};

/// Geometry of a 6-UPS Stewart platform. Frames as in CONVENTIONS.md.
struct PlatformGeometry {
  std::array<Eigen::Vector3d, 6> base_joints_mm;      ///< in frame B
  std::array<Eigen::Vector3d, 6> platform_joints_mm;  ///< in frame P
  Rigid3 B_from_UG;
  Rigid3 P_from_LG;
  double gd_mm = 0;
  std::array<Actuator, 6> actuators;
  std::optional<JointLimits> joint_limits;

  /// B_from_P = B_from_UG * UG_from_LG * LG_from_P.
  [[nodiscard]] Rigid3 B_from_P(const Pose& pose) const;
  [[nodiscard]] Pose pose_from_B_from_P(const Rigid3& B_from_P_motion) const;
};

/// Leg lengths in mm at B_from_P.
[[nodiscard]] LegVector leg_lengths(const PlatformGeometry& geometry, const Rigid3& B_from_P);

/// d(leg lengths)/d(dt, dr) in the convention of covariance.h: row = [u^T, (R b x u)^T], u the unit leg
/// vector.
[[nodiscard]] Matrix6d leg_jacobian(const PlatformGeometry& geometry, const Rigid3& B_from_P);

[[nodiscard]] LegVector readings_from_lengths(const PlatformGeometry& geometry, const LegVector& lengths_mm);
[[nodiscard]] LegVector lengths_from_readings(const PlatformGeometry& geometry, const LegVector& readings);

}  // namespace hexcal
