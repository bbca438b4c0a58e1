#pragma once

#include "kinematics/platform.h"

namespace hexcal {

/// Readings of the six actuators at a pose and their derivatives. Leg i depends on its own joints only, so
/// the derivatives by joints are one row of three per leg.
struct ReadingJacobians {
  LegVector readings;
  Matrix6d by_pose;                         ///< (dt, dr) of B_from_P as in covariance.h
  Eigen::Matrix<double, 6, 3> by_base;      ///< row i: reading i by base joint i, per mm
  Eigen::Matrix<double, 6, 3> by_platform;  ///< row i: reading i by platform joint i, per mm
  LegVector by_offset;                      ///< reading i by offset_mm of leg i
  LegVector by_scale;                       ///< reading i by mm_per_unit of leg i
  LegVector by_lead;                        ///< reading i by the common screw lead; zero without screws
};

[[nodiscard]] ReadingJacobians reading_jacobians(const PlatformGeometry& geometry, const Rigid3& B_from_P);

/// Derivatives of the pose (dt, dr) that forward kinematics finds at fixed readings; columns as named.
struct PoseJacobians {
  Matrix6d by_readings;
  Eigen::Matrix<double, 6, 18> by_base;      ///< columns 3 i .. 3 i + 2: base joint of leg i
  Eigen::Matrix<double, 6, 18> by_platform;  ///< likewise
  Matrix6d by_offset;                        ///< column i: leg i
  Matrix6d by_scale;
  Vector6d by_lead;
};

/// By the implicit function theorem; grows without bound towards a singular pose and is not finite in one.
[[nodiscard]] PoseJacobians pose_jacobians(const PlatformGeometry& geometry, const Rigid3& B_from_P);

}  // namespace hexcal
