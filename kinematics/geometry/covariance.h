#pragma once

#include "kinematics/geometry/pose.h"

namespace hexcal {

/// The one perturbation convention of hexcal for a motion b_from_a: a 6-vector (dt, dr), dt in mm and dr in
/// rad, both in frame b, with
///   translation' = translation + dt,   rotation' = exp(dr) * rotation.
/// A Matrix6d covariance of a motion is the covariance of that vector, in mm^2, mm rad and rad^2.
[[nodiscard]] Rigid3 perturbed(const Rigid3& b_from_a, const Vector6d& delta);

/// The delta with perturbed(from, delta) == to.
[[nodiscard]] Vector6d perturbation_between(const Rigid3& from, const Rigid3& to);

/// Jacobians of c_from_a = c_from_b * b_from_a by the perturbations of its factors.
[[nodiscard]] Matrix6d product_jacobian_left(const Rigid3& c_from_b, const Rigid3& b_from_a);
[[nodiscard]] Matrix6d product_jacobian_right(const Rigid3& c_from_b, const Rigid3& b_from_a);

/// Jacobian of inverse(b_from_a) by the perturbation of b_from_a.
[[nodiscard]] Matrix6d inverse_jacobian(const Rigid3& b_from_a);

/// Jacobian d(x, y, z, roll, pitch, yaw) / d(dt, dr) of a pose given as motion home_from_LG. Grows without
/// bound towards pitch = +-90 deg.
[[nodiscard]] Matrix6d pose_parameters_jacobian(const Pose& pose);

}  // namespace hexcal
