#include "calibration/machine_parameters.h"

#include <fmt/format.h>

#include <array>

#include "kinematics/geometry/covariance.h"

namespace hexcal {
namespace {

constexpr std::array kLegNames{"base x",     "base y",     "base z", "platform x",
                               "platform y", "platform z", "offset", "scale"};
constexpr std::array kFrameNames{"x", "y", "z", "rx", "ry", "rz"};

}  // namespace

std::string parameter_name(const ParameterLayout& layout, int index) {
  constexpr int kPerLeg = ParameterLayout::kPerLeg;
  if (index < ParameterLayout::kLegs)
    return fmt::format("leg {} {}", index / kPerLeg + 1,
                       kLegNames.at(static_cast<std::size_t>(index % kPerLeg)));
  if (index == ParameterLayout::kLead) return "screw lead";
  if (index < ParameterLayout::kCurves) {
    const int i = index - ParameterLayout::kBaseFrame;
    return fmt::format("{} frame {}", i < 6 ? "UG" : "LG", kFrameNames.at(static_cast<std::size_t>(i % 6)));
  }
  if (index < layout.common_curve()) {
    const int i = index - ParameterLayout::kCurves;
    return fmt::format("leg {} curve {}", i / layout.curve_terms + 1, i % layout.curve_terms + 2);
  }
  if (index < layout.sag()) return fmt::format("common curve {}", index - layout.common_curve() + 2);
  if (index < layout.backlash()) return fmt::format("sag {}", index - layout.sag() + 1);
  return fmt::format("leg {} backlash", index - layout.backlash() + 1);
}

ParameterKind parameter_kind(const ParameterLayout& layout, int index) {
  if (index < ParameterLayout::kLegs) {
    const int i = index % ParameterLayout::kPerLeg;
    return i < 6 ? ParameterKind::joint : i == 6 ? ParameterKind::offset : ParameterKind::scale;
  }
  if (index == ParameterLayout::kLead) return ParameterKind::lead;
  if (index < ParameterLayout::kCurves) return ParameterKind::frame;
  if (index < layout.common_curve()) return ParameterKind::curve;
  if (index < layout.sag()) return ParameterKind::common_curve;
  return index < layout.backlash() ? ParameterKind::sag : ParameterKind::backlash;
}

const char* parameter_unit(const ParameterLayout& layout, int index) {
  const ParameterKind kind = parameter_kind(layout, index);
  if (kind == ParameterKind::scale) return "%";
  if (kind == ParameterKind::frame && (index - ParameterLayout::kBaseFrame) % 6 >= 3) return "deg";
  if (kind == ParameterKind::sag && index > layout.sag()) return "mm^2";
  return "mm";
}

double parameter_unit_factor(const ParameterLayout& layout, int index) {
  const std::string unit = parameter_unit(layout, index);
  return unit == "%" ? 100.0 : unit == "deg" ? kDegPerRad : 1.0;
}

MachineModel corrected_machine(const MachineModel& nominal, const ParameterLayout& layout,
                               const Eigen::VectorXd& corrections,
                               const Eigen::Matrix<double, 6, 2>& stroke_range) {
  MachineModel machine = nominal;
  PlatformGeometry& geometry = machine.geometry;
  for (std::size_t k = 0; k < 6; ++k) {
    const Eigen::Index at = ParameterLayout::kPerLeg * static_cast<Eigen::Index>(k);
    const auto row = static_cast<Eigen::Index>(k);
    geometry.base_joints_mm[k] += corrections.segment<3>(at);
    geometry.platform_joints_mm[k] += corrections.segment<3>(at + 3);
    // The scale turns about the middle of the stroke, so that it and the offset are nearly uncorrelated.
    Actuator& actuator = geometry.actuators[k];
    const double center = 0.5 * (stroke_range(row, 0) + stroke_range(row, 1));
    actuator.offset_mm += corrections[at + 6] - corrections[at + 7] * actuator.mm_per_unit * center;
    actuator.mm_per_unit *= 1.0 + corrections[at + 7];
    if (layout.curve_terms > 0) {
      StrokeCurve& curve = machine.stroke_curves[k];
      curve.low = stroke_range(row, 0);
      curve.high = stroke_range(row, 1);
      const Eigen::Index first = ParameterLayout::kCurves + layout.curve_terms * row;
      const Eigen::VectorXd coefficients = corrections.segment(first, layout.curve_terms) +
                                           corrections.segment(layout.common_curve(), layout.curve_terms);
      curve.coefficients_mm.assign(coefficients.begin(), coefficients.end());
    }
  }
  if (geometry.screw) geometry.screw->lead_mm += corrections[ParameterLayout::kLead];
  geometry.B_from_UG = perturbed(geometry.B_from_UG, corrections.segment<6>(ParameterLayout::kBaseFrame));
  geometry.P_from_LG = perturbed(geometry.P_from_LG, corrections.segment<6>(ParameterLayout::kGripFrame));
  machine.sag += corrections.segment<4>(layout.sag());
  machine.backlash_mm += corrections.segment<6>(layout.backlash());
  return machine;
}

}  // namespace hexcal
