#pragma once

#include <Eigen/Core>

#include "calibration/machine_parameters.h"
#include "calibration/observation.h"

namespace hexcal {

/// Leg residuals of one pose, actuator_lengths(measured) - actuator_output(readings) in mm, and their
/// analytic Jacobian by all parameters of a layout.
struct LegLinearization {
  LegVector residuals_mm;
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian;  ///< 6 x layout.size()
  Matrix6d by_pose;                                   ///< by x, y, z, roll, pitch, yaw of the measured pose
};

/// `nominal` is the machine to which the corrections apply, `machine` the corrected one; `stroke_range` as in
/// corrected_machine. The influence of geometry on the sag is neglected in the Jacobian, not in the
/// residual: it is a small correction itself.
[[nodiscard]] LegLinearization linearize_legs(const MachineModel& machine, const MachineModel& nominal,
                                              const ParameterLayout& layout,
                                              const Eigen::Matrix<double, 6, 2>& stroke_range,
                                              const Pose& measured, const LegVector& readings,
                                              const LegVector& approach);

}  // namespace hexcal
