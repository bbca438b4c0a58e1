#pragma once

#include <Eigen/Core>
#include <set>
#include <string>
#include <vector>

#include "calibration/machine_model.h"

namespace hexcal {

/// Numbers of a MachineModel that identification may change, as one vector of corrections to a nominal
/// machine. Order: per leg base x y z, platform x y z (mm), offset at mid stroke (mm), scale (relative); then
/// screw lead (mm), B_from_UG and P_from_LG (perturbations of covariance.h), stroke curves (per leg, mm), the
/// part of these curves that all legs share (mm), sag (4), backlash (6, mm). Legs of one build have much of
/// their curves in common; the shared part is what few poses can tell.
struct ParameterLayout {
  static constexpr int kPerLeg = 8;
  static constexpr int kLegs = 6 * kPerLeg;
  static constexpr int kLead = kLegs;
  static constexpr int kBaseFrame = kLead + 1;
  static constexpr int kGripFrame = kBaseFrame + 6;
  static constexpr int kCurves = kGripFrame + 6;
  int curve_terms = 0;  ///< Legendre terms per leg

  [[nodiscard]] int common_curve() const { return kCurves + 6 * curve_terms; }
  [[nodiscard]] int sag() const { return common_curve() + curve_terms; }
  [[nodiscard]] int backlash() const { return sag() + 4; }
  [[nodiscard]] int size() const { return backlash() + 6; }
};

/// What kind of number a parameter is; parameters of a kind share a tolerance.
enum class ParameterKind { joint, offset, scale, lead, frame, curve, common_curve, sag, backlash };

/// "leg 1 base x", "leg 6 scale", "screw lead", "UG frame x", "LG frame rz", "leg 2 curve 3", "common curve
/// 3", "sag 1", "leg 4 backlash".
[[nodiscard]] std::string parameter_name(const ParameterLayout& layout, int index);
[[nodiscard]] ParameterKind parameter_kind(const ParameterLayout& layout, int index);
/// "mm", "%" for scales, "deg" for rotations, "mm^2".
[[nodiscard]] const char* parameter_unit(const ParameterLayout& layout, int index);
/// Factor from the internal number to that unit.
[[nodiscard]] double parameter_unit_factor(const ParameterLayout& layout, int index);

/// The machine with `corrections` applied to `nominal`. Stroke curves take the range of `stroke_range`
/// (readings low and high of each leg).
[[nodiscard]] MachineModel corrected_machine(const MachineModel& nominal, const ParameterLayout& layout,
                                             const Eigen::VectorXd& corrections,
                                             const Eigen::Matrix<double, 6, 2>& stroke_range);

/// Which parameters are free: index of the free parameter that each follows, or -1 where it is fixed. Several
/// parameters may follow one (tied).
struct ParameterSelection {
  std::vector<int> free_of;
  int free_count = 0;
};

}  // namespace hexcal
