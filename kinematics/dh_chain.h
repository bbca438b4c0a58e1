#pragma once

#include <array>
#include <span>

#include "kinematics/platform.h"

namespace hexcal {

/// The path base - leg - platform as a serial chain in modified Denavit-Hartenberg form (Craig 2005,
/// sec. 3.4):
///   T(i-1, i) = Rx(alpha_{i-1}) Tx(a_{i-1}) Rz(theta_i) Tz(d_i),
///   alpha = 0, -90, +90, 0, -90, +90 deg, all a = 0, d3 = leg length, other d = 0, theta3 = 0,
/// between two fixed ends: B_from_P = B_from_A * T06 * inverse(P_from_C). The origins of A and C are the
/// joint centres. Their z axes are tangential, which keeps theta2 and theta5 near 90 deg, far from where the
/// variables are not defined (0 and 180 deg); their x axes make theta1 = theta6 = 0 at home and keep theta4
/// off +-180 deg.
struct LegChain {
  Rigid3 B_from_A;
  Rigid3 P_from_C;
};

/// The six chains of a geometry, leg 0..5.
[[nodiscard]] std::array<LegChain, 6> leg_chains(const PlatformGeometry& geometry);

/// (theta1, theta2, d3, theta4, theta5, theta6) in rad and mm of a leg at a pose, in closed form: theta1,
/// theta4, theta6 in (-pi, pi], theta2 and theta5 in [0, pi]. Where a leg is parallel to its A or C z axis,
/// the variables that then share one axis are split by setting theta1 or theta6 to zero.
[[nodiscard]] Vector6d dh_variables(const LegChain& chain, const Rigid3& B_from_P);

/// T06, the motion from C to A along the leg.
[[nodiscard]] Rigid3 a_from_c(const Vector6d& dh);

/// The pose of the platform that one leg's variables tell.
[[nodiscard]] Rigid3 pose_along_leg(const LegChain& chain, const Vector6d& dh);

/// Actual minus target, angles wrapped to +-pi.
[[nodiscard]] Vector6d dh_error(const Vector6d& actual, const Vector6d& target);

/// One row per leg: the DH variables of all legs at a pose.
[[nodiscard]] Matrix6d dh_table(const std::array<LegChain, 6>& chains, const Rigid3& B_from_P);

/// One row per leg: the error of each DH variable between two poses.
[[nodiscard]] Matrix6d dh_error_table(const std::array<LegChain, 6>& chains, const Rigid3& actual_B_from_P,
                                      const Rigid3& target_B_from_P);

/// Mean of the translations in mm. At least one motion.
[[nodiscard]] Eigen::Vector3d mean_translation(std::span<const Rigid3> motions);

/// The rotation nearest to all in the chordal (Frobenius) norm: the projection of the sum of the matrices on
/// SO(3) by its SVD (Moakher 2002; Hartley et al. 2013, sec. 5.3). At least one motion.
[[nodiscard]] Eigen::Quaterniond mean_rotation(std::span<const Rigid3> motions);

/// Both means as a motion.
[[nodiscard]] Rigid3 mean_motion(std::span<const Rigid3> motions);

}  // namespace hexcal
