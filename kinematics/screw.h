#pragma once

#include "kinematics/platform.h"

namespace hexcal {

/// Twist of each leg about itself in rad, (-pi, pi]: the angle from the base axis to the platform axis, both
/// seen along the leg. Needs geometry.screw.
[[nodiscard]] LegVector leg_twists(const PlatformGeometry& geometry, const Rigid3& B_from_P);

/// The lengths that the actuators make: joint distance + lead * twist / 2 pi (LinuxCNC's genhexkins adds it
/// with the same sign); without screws the joint distances.
[[nodiscard]] LegVector actuated_lengths(const PlatformGeometry& geometry, const Rigid3& B_from_P);

/// d(actuated lengths)/d(dt, dr) in the convention of covariance.h; without screws leg_jacobian.
[[nodiscard]] Matrix6d actuated_jacobian(const PlatformGeometry& geometry, const Rigid3& B_from_P);

/// Twist of one leg by its unit vector u and the rotated platform axis n_p, with its gradients.
struct Twist {
  double angle_rad = 0;
  Eigen::Vector3d by_u = Eigen::Vector3d::Zero();
  Eigen::Vector3d by_platform_axis = Eigen::Vector3d::Zero();
};
[[nodiscard]] Twist leg_twist(const Eigen::Vector3d& u, const Eigen::Vector3d& base_axis,
                              const Eigen::Vector3d& platform_axis_in_B);

/// Axes for a machine whose drawings do not tell: tangential at the base, and the same direction at home on
/// the platform, so that no leg is twisted at home.
[[nodiscard]] ScrewLead screw_with_tangential_axes(const PlatformGeometry& geometry, double lead_mm);

}  // namespace hexcal
