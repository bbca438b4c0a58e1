#pragma once

#include <array>
#include <optional>
#include <string>

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

/// Largest angles of a leg from its direction at home (the joints' rest direction).
struct JointLimits {
  double base_rad = 0;      ///< half angle of the cone at the base joint, seen in frame B
  double platform_rad = 0;  ///< half angle of the cone at the platform joint, seen in frame P
  /// Largest turns of the base U joint about its first and second axis; absent means the cone alone.
  std::optional<std::array<double, 2>> base_axes_rad = std::nullopt;
};

/// Passive rotation of the nuts: a leg that twists by w between its two joints reads lead w / 2 pi longer
/// (Huang et al., Mech. Sci. 12, 2021; sign and twist as in LinuxCNC's genhexkins); see screw.h.
struct ScrewLead {
  double lead_mm = 0;                        ///< per revolution, positive for a right-hand screw
  std::array<Eigen::Vector3d, 6> base_axes;  ///< unit, in B: the U joint's axis that is fixed to the base
  std::array<Eigen::Vector3d, 6>
      platform_axes;  ///< unit, in P: the joint's axis that is fixed to the platform
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
  std::optional<double> leg_radius_mm = std::nullopt;  ///< legs are capsules of this radius
  std::optional<ScrewLead> screw = std::nullopt;
  /// Least height of O_UG over O_LG along UG's z. Without it the grips may come together but not pass each
  /// other; where they already do at home (gd_mm = 0), nothing is known of them.
  std::optional<double> min_gap_mm = std::nullopt;

  /// B_from_P = B_from_UG * UG_from_LG * LG_from_P.
  [[nodiscard]] Rigid3 B_from_P(const Pose& pose) const;
  [[nodiscard]] Pose pose_from_B_from_P(const Rigid3& B_from_P_motion) const;
  [[nodiscard]] Rigid3 home_B_from_P() const { return B_from_P(Pose{}); }
};

/// Leg lengths in mm at B_from_P.
[[nodiscard]] LegVector leg_lengths(const PlatformGeometry& geometry, const Rigid3& B_from_P);

/// d(leg lengths)/d(dt, dr) in the convention of covariance.h: row = [u^T, (R b x u)^T], u the unit leg
/// vector.
[[nodiscard]] Matrix6d leg_jacobian(const PlatformGeometry& geometry, const Rigid3& B_from_P);

[[nodiscard]] LegVector readings_from_lengths(const PlatformGeometry& geometry, const LegVector& lengths_mm);
[[nodiscard]] LegVector lengths_from_readings(const PlatformGeometry& geometry, const LegVector& readings);

/// Centroid of the platform joints in P and the rms distance of the joints from it: the point at which, and
/// the length by which, rotations are weighed against translations (README.md).
[[nodiscard]] Eigen::Vector3d platform_centroid_mm(const PlatformGeometry& geometry);
[[nodiscard]] double characteristic_length_mm(const PlatformGeometry& geometry);

/// Why no machine can have this geometry (not finite, coincident joints, empty strokes, all legs through one
/// line, singular at home), or nothing.
[[nodiscard]] std::optional<std::string> geometry_fault(const PlatformGeometry& geometry);

}  // namespace hexcal
