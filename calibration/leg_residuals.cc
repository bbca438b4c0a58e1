#include "calibration/leg_residuals.h"

#include <algorithm>

#include "kinematics/geometry/covariance.h"
#include "kinematics/jacobian.h"
#include "kinematics/screw.h"

namespace hexcal {

LegLinearization linearize_legs(const MachineModel& machine, const MachineModel& nominal,
                                const ParameterLayout& layout,
                                const Eigen::Matrix<double, 6, 2>& stroke_range, const Pose& measured,
                                const LegVector& readings, const LegVector& approach) {
  const PlatformGeometry& geometry = machine.geometry;
  const Rigid3 B_from_P = geometry.B_from_P(measured);
  const Matrix6d legs = actuated_jacobian(geometry, B_from_P);
  const ReadingJacobians by_joints = reading_jacobians(geometry, B_from_P);

  LegLinearization out;
  out.residuals_mm = actuator_lengths(machine, measured) - actuator_output(machine, readings, approach);
  out.by_pose = leg_by_pose_jacobian(geometry, measured);
  out.jacobian.setZero(6, layout.size());
  for (Eigen::Index k = 0; k < 6; ++k) {
    const auto leg = static_cast<std::size_t>(k);
    const double mm_per_unit = geometry.actuators[leg].mm_per_unit;
    const Eigen::Index at = ParameterLayout::kPerLeg * k;
    const double center = 0.5 * (stroke_range(k, 0) + stroke_range(k, 1));
    out.jacobian.row(k).segment<3>(at) = mm_per_unit * by_joints.by_base.row(k);
    out.jacobian.row(k).segment<3>(at + 3) = mm_per_unit * by_joints.by_platform.row(k);
    out.jacobian(k, ParameterLayout::kLead) = mm_per_unit * by_joints.by_lead[k];
    out.jacobian(k, at + 6) = -1.0;
    out.jacobian(k, at + 7) = -nominal.geometry.actuators[leg].mm_per_unit * (readings[k] - center);
    out.jacobian(k, layout.backlash() + k) = -0.5 * approach[k];
    if (layout.curve_terms > 0) {
      const double half = 0.5 * (stroke_range(k, 1) - stroke_range(k, 0));
      const double s = half != 0 ? std::clamp((readings[k] - center) / half, -1.0, 1.0) : 0.0;
      const std::vector<double> terms = legendre_terms(s, static_cast<std::size_t>(layout.curve_terms));
      for (int j = 0; j < layout.curve_terms; ++j)
        out.jacobian(k, ParameterLayout::kCurves + layout.curve_terms * k + j) =
            out.jacobian(k, layout.common_curve() + j) = -terms[static_cast<std::size_t>(j)];
    }
  }
  out.jacobian.middleCols<4>(layout.sag()) = -sag_basis(geometry, B_from_P);
  const Rigid3 UG_from_P = inverse(geometry.B_from_UG) * B_from_P;
  const Rigid3 LG_from_P = inverse(geometry.P_from_LG);
  out.jacobian.middleCols<6>(ParameterLayout::kBaseFrame) =
      legs * product_jacobian_left(geometry.B_from_UG, UG_from_P);
  out.jacobian.middleCols<6>(ParameterLayout::kGripFrame) =
      legs * product_jacobian_right(B_from_P * geometry.P_from_LG, LG_from_P) *
      inverse_jacobian(geometry.P_from_LG);
  return out;
}

}  // namespace hexcal
