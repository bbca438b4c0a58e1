#pragma once

#include <span>

#include "kinematics/geometry/pose.h"

namespace hexcal {

/// A pose that was wanted and the one that was reached.
struct PosePair {
  Pose target;
  Pose actual;
};

/// Statistics of pose errors (actual minus target, CONVENTIONS.md) in mm and rad.
struct ErrorStatistics {
  int poses = 0;
  Vector6d range = Vector6d::Zero();     ///< largest minus smallest error of each parameter
  double position_magnitude_mm = 0;      ///< the paper's eq. 7 of the ranges of x, y, z
  double orientation_magnitude_rad = 0;  ///< the same of roll, pitch, yaw
  Vector6d mean = Vector6d::Zero();
  Vector6d rms = Vector6d::Zero();  ///< of each parameter, about zero
  Vector6d max_abs = Vector6d::Zero();
  double position_rms_mm = 0;  ///< of the distance between the two origins (three axes together)
  double position_max_mm = 0;
  double orientation_rms_rad = 0;  ///< of the angle of the rotation from target to actual
  double orientation_max_rad = 0;
};

/// Statistics over all pairs; of none, zeros.
[[nodiscard]] ErrorStatistics error_statistics(std::span<const PosePair> pairs);

/// Squared size of a pose error (or of its sigmas), mm^2: angles, in rad, as arcs at length_mm.
[[nodiscard]] double squares_mm2(const Vector6d& error, double length_mm);

/// Karmakar and Turner, eq. 7: the root mean square of three error ranges. It is no true rms: it weighs only
/// the two extreme poses of each parameter and is blind to a constant error.
[[nodiscard]] double range_magnitude(const Eigen::Vector3d& ranges);

/// Improvement in percent of `after` on `before`, negative where it got worse; 0 if before is 0.
[[nodiscard]] double improvement_percent(double before, double after);

}  // namespace hexcal
