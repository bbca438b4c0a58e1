#include "calibration/unmeasured.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <map>

#include "calibration/compensation.h"
#include "kinematics/platform.h"

namespace hexcal {
namespace {

constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

struct Expected {
  Vector6d pose;
  Vector6d variance;
};

// What the identified geometry expects at each held-out pose, and how well it knows it.
std::map<std::size_t, Expected> expected_by_geometry(const MethodComparison& comparison) {
  std::map<std::size_t, Expected> out;
  for (std::size_t m = 0; m < comparison.methods.size(); ++m) {
    const CrossValidation& method = comparison.methods[m];
    if (method.name != "kinematic" || !method.failure.empty() || !comparison.fitted[m]) continue;
    for (std::size_t p = 0; p < method.held_out.size(); ++p) {
      const Pose& pose = method.held_out[p].target;
      const Vector6d sigma = predicted_sigma(*comparison.fitted[m]->identified, pose);
      out[method.held_out_index[p]] = {pose.vector(), sigma.cwiseAbs2()};
    }
  }
  return out;
}

void empty_statistics(const std::array<bool, 6>& tested, CrossValidation& method) {
  ErrorStatistics& e = method.errors;
  for (Eigen::Index k = 0; k < 6; ++k) {
    if (tested[static_cast<std::size_t>(k)]) continue;
    for (Vector6d* six : {&e.range, &e.mean, &e.rms, &e.max_abs}) (*six)[k] = kNotMeasured;
    if (k < 3) {
      e.position_magnitude_mm = e.position_rms_mm = e.position_max_mm = kNotMeasured;
      method.position_rms_se_mm = kNotMeasured;
    } else {
      e.orientation_magnitude_rad = e.orientation_rms_rad = e.orientation_max_rad = kNotMeasured;
      method.orientation_rms_se_rad = kNotMeasured;
    }
  }
}

}  // namespace

void count_unmeasured(const PlatformGeometry& nominal, const ObservationSet& observations,
                      bool frames_unknown, MethodComparison& comparison) {
  std::array<bool, 6> tested{true, true, true, true, true, true};
  for (const CrossValidation& method : comparison.methods)
    for (const std::size_t i : method.held_out_index)
      for (std::size_t k = 0; k < 6; ++k) tested[k] = tested[k] && observations.poses[i].observed[k];
  if (tested == std::array<bool, 6>{true, true, true, true, true, true}) return;
  const std::map<std::size_t, Expected> geometry = expected_by_geometry(comparison);
  const double length_mm = characteristic_length_mm(nominal);
  std::size_t best = comparison.methods.size();
  for (std::size_t m = 0; m < comparison.methods.size(); ++m) {
    CrossValidation& method = comparison.methods[m];
    if (!method.failure.empty() || method.held_out.empty()) continue;
    empty_statistics(tested, method);
    if (geometry.empty() || frames_unknown) continue;
    double position = 0;
    double orientation = 0;
    for (std::size_t p = 0; p < method.held_out.size(); ++p) {
      const PosePair& pair = method.held_out[p];
      const auto known = geometry.find(method.held_out_index[p]);
      if (known == geometry.end()) continue;
      const Vector6d measured = pose_error(pair.actual, pair.target);
      const Vector6d modelled = pose_error(Pose::from_vector(known->second.pose), pair.target);
      for (Eigen::Index k = 0; k < 6; ++k) {
        const bool seen = observations.poses[method.held_out_index[p]].observed[static_cast<std::size_t>(k)];
        const double square =
            seen ? measured[k] * measured[k] : modelled[k] * modelled[k] + known->second.variance[k];
        (k < 3 ? position : orientation) += square;
      }
    }
    const double n = static_cast<double>(method.held_out.size());
    method.predicted = PredictedOverAll{std::sqrt(position / n), std::sqrt(orientation / n)};
    const auto loss = [&](std::size_t i) {
      const PredictedOverAll& e = *comparison.methods[i].predicted;
      return e.position_mm * e.position_mm + length_mm * length_mm * e.orientation_rad * e.orientation_rad;
    };
    if (best == comparison.methods.size() || loss(m) < loss(best)) best = m;
  }
  if (best == comparison.methods.size()) return;
  comparison.best = comparison.chosen = best;
  comparison.why =
      fmt::format("{}: least predicted error over all six coordinates, of which not all were measured",
                  comparison.methods[best].name);
}

}  // namespace hexcal
