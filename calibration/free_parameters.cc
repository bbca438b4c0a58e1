#include "calibration/free_parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <string_view>

#include "kinematics/geometry/input_error.h"

namespace hexcal {
namespace {

constexpr double kWidestMm = 1000;
constexpr double kWidestRad = 1;

// A smooth curve's terms fall off with their degree.
double curve_tolerance_mm(const Tolerances& t, int term) { return t.curve_mm / (term + 1); }

double tolerance_of(const Tolerances& t, const ParameterLayout& layout, int index) {
  switch (parameter_kind(layout, index)) {
    case ParameterKind::joint:
      return t.joint_mm;
    case ParameterKind::offset:
      return t.offset_mm;
    case ParameterKind::scale:
      return t.scale;
    case ParameterKind::lead:
      return t.lead_mm;
    case ParameterKind::frame:
      return std::numeric_limits<double>::infinity();
    case ParameterKind::curve:
      return curve_tolerance_mm(t, (index - ParameterLayout::kCurves) % layout.curve_terms);
    case ParameterKind::common_curve:
      return curve_tolerance_mm(t, index - layout.common_curve());
    case ParameterKind::sag:
      return index == layout.sag() ? t.sag_mm : t.sag_mm * 100.0;
    case ParameterKind::backlash:
      return t.backlash_mm;
  }
  return std::numeric_limits<double>::infinity();
}

bool is_free(const IdentifyOptions& options, const ParameterLayout& layout, int index) {
  switch (parameter_kind(layout, index)) {
    case ParameterKind::joint:
      return options.geometry;
    case ParameterKind::offset:
      return true;
    case ParameterKind::scale:
      return options.scales;
    case ParameterKind::lead:
      return options.screw_lead;
    case ParameterKind::frame:
      return options.frames_unknown;
    case ParameterKind::curve:
    case ParameterKind::common_curve:
      return true;
    case ParameterKind::sag:
      return options.sag;
    case ParameterKind::backlash:
      return options.backlash;
  }
  return false;
}

ParameterSelection select(const IdentifyOptions& options, const ParameterLayout& layout) {
  ParameterSelection selection;
  selection.free_of.assign(static_cast<std::size_t>(layout.size()), -1);
  std::vector<int> leader_of_tie(options.tied.size(), -1);
  for (int i = 0; i < layout.size(); ++i) {
    const std::string parameter = parameter_name(layout, i);
    if (!is_free(options, layout, i) || options.fixed.count(parameter) != 0) continue;
    int& free = selection.free_of[static_cast<std::size_t>(i)];
    for (std::size_t tie = 0; tie < options.tied.size(); ++tie) {
      const auto& names = options.tied[tie];
      if (std::find(names.begin(), names.end(), parameter) == names.end()) continue;
      if (leader_of_tie[tie] < 0) leader_of_tie[tie] = selection.free_count++;
      free = leader_of_tie[tie];
    }
    if (free < 0) free = selection.free_count++;
  }
  return selection;
}

}  // namespace

void IdentifyOptions::validate() const {
  const auto positive = [](double value, const char* field) {
    if (!(value > 0)) throw InputError(fmt::format("{}: found {}, wanted more than 0", field, value));
  };
  positive(tolerances.joint_mm, "joint_mm");
  positive(tolerances.offset_mm, "offset_mm");
  positive(tolerances.scale, "scale");
  positive(tolerances.lead_mm, "lead_mm");
  positive(tolerances.curve_mm, "curve_mm");
  positive(tolerances.sag_mm, "sag_mm");
  positive(tolerances.backlash_mm, "backlash_mm");
  positive(leg_sigma_mm, "leg_sigma_mm");
  positive(max_iterations, "max_iterations");
  if (curve_terms < 0 || curve_terms > 12)
    throw InputError(fmt::format("curve_terms: found {}, wanted 0 to 12", curve_terms));
  const ParameterLayout layout{curve_terms};
  std::set<std::string> known;
  for (int i = 0; i < layout.size(); ++i) known.insert(parameter_name(layout, i));
  std::vector<std::vector<std::string>> named = tied;
  named.emplace_back(fixed.begin(), fixed.end());
  for (const auto& names : named) {
    for (const std::string& parameter : names) {
      if (known.count(parameter) == 0)
        throw InputError(fmt::format("'{}' is no parameter, wanted for instance 'leg 1 base x'", parameter));
    }
  }
}

FreeParameters free_parameters(const IdentifyOptions& options) {
  FreeParameters free;
  free.layout.curve_terms = options.curve_terms;
  free.selection = select(options, free.layout);
  const auto count = static_cast<std::size_t>(free.selection.free_count);
  free.tolerances.setZero(free.selection.free_count);
  free.widest.setZero(free.selection.free_count);
  free.kinds.resize(count);
  for (int i = 0; i < free.layout.size(); ++i) {
    const int j = free.selection.free_of[static_cast<std::size_t>(i)];
    if (j < 0) continue;
    free.tolerances[j] = tolerance_of(options.tolerances, free.layout, i);
    free.kinds[static_cast<std::size_t>(j)] = parameter_kind(free.layout, i);
    free.widest[j] = std::string_view(parameter_unit(free.layout, i)) == "deg" ? kWidestRad : kWidestMm;
  }
  return free;
}

}  // namespace hexcal
