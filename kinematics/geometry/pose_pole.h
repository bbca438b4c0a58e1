#pragma once

#include "kinematics/geometry/pose.h"

namespace hexcal {

/// Whether the covariance of the parameters (x, y, z, roll, pitch, yaw), mm and rad, tells how far off roll
/// and yaw may be one by one. Near pitch = +-90 deg both turn about one axis: only yaw - roll (at +90 deg) or
/// yaw + roll (at -90 deg) is known, and where their sigmas exceed 0.05 rad the linear law fails.
[[nodiscard]] bool roll_and_yaw_are_known(const Pose& pose, const Matrix6d& covariance);

}  // namespace hexcal
