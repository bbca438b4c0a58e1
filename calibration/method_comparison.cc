#include "calibration/method_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "kinematics/forward.h"

namespace hexcal {
namespace {

constexpr int kCurveTerms = 4;

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double standard_error(const std::vector<double>& values) {
  const double n = static_cast<double>(values.size());
  if (n < 2) return 0;
  const double m = mean(values);
  double squares = 0;
  for (const double v : values) squares += (v - m) * (v - m);
  return std::sqrt(squares / (n - 1) / n);
}

// Poses spread over the folds in the order in which they were given: fold of pose i is i mod folds.
std::vector<std::vector<std::size_t>> folds_of(const ObservationSet& observations, int folds) {
  std::vector<std::vector<std::size_t>> out(static_cast<std::size_t>(folds));
  std::size_t next = 0;
  for (std::size_t i = 0; i < observations.poses.size(); ++i) {
    const PoseObservation& pose = observations.poses[i];
    if (pose.is_definition || !pose.complete()) continue;
    out[next++ % out.size()].push_back(i);
  }
  return out;
}

CrossValidation validate(const PlatformGeometry& nominal, const ObservationSet& observations,
                         const Candidate& candidate, const std::vector<std::vector<std::size_t>>& folds) {
  CrossValidation result;
  result.name = candidate.name;
  result.method = candidate.method;
  result.complexity = candidate.complexity;
  const double length = characteristic_length_mm(nominal);
  for (const auto& held_out : folds) {
    std::vector<std::size_t> kept;
    for (std::size_t i = 0; i < observations.poses.size(); ++i)
      if (std::find(held_out.begin(), held_out.end(), i) == held_out.end()) kept.push_back(i);
    const auto fitted = fit_candidate(nominal, observations.subset(kept), candidate, &result.failure);
    if (!fitted) return result;
    for (const std::size_t i : held_out) {
      const PoseObservation& pose = observations.poses[i];
      std::optional<Pose> expected;
      if (fitted->identified) {
        expected = machine_pose(fitted->model.machine, pose.readings, pose.measured, pose.approach);
      } else {
        expected = pose_for_readings(fitted->model, pose.readings);
      }
      if (!expected) {
        result.failure = fmt::format("no pose at the readings of '{}'", pose.id);
        return result;
      }
      result.held_out.push_back({*expected, pose.measured});
      result.held_out_index.push_back(i);
    }
  }
  std::vector<double> position_squares;
  std::vector<double> orientation_squares;
  for (const PosePair& pair : result.held_out) {
    const double mm = (pair.actual.position_mm - pair.target.position_mm).norm();
    const double rad =
        rotation_distance(quaternion_from_rpy(pair.actual.rpy_rad), quaternion_from_rpy(pair.target.rpy_rad));
    position_squares.push_back(mm * mm);
    orientation_squares.push_back(rad * rad);
    result.losses_mm2.push_back(mm * mm + length * length * rad * rad);
  }
  result.poses = static_cast<int>(result.held_out.size());
  result.errors = error_statistics(result.held_out);
  // d sqrt(m) = dm / (2 sqrt(m)).
  const auto root_error = [](const std::vector<double>& squares, double rms) {
    return rms > 0 ? standard_error(squares) / (2 * rms) : 0.0;
  };
  result.position_rms_se_mm = root_error(position_squares, result.errors.position_rms_mm);
  result.orientation_rms_se_rad = root_error(orientation_squares, result.errors.orientation_rms_rad);
  return result;
}

}  // namespace

double CrossValidation::mean_loss_mm2() const { return losses_mm2.empty() ? 0.0 : mean(losses_mm2); }

std::vector<Candidate> candidates_for(const ObservationSet& observations, const IdentifyOptions& base) {
  bool targets = !observations.poses.empty();
  bool approaches = !observations.poses.empty();
  for (const PoseObservation& pose : observations.poses) {
    if (!pose.is_definition) targets = targets && pose.target.has_value();
    approaches = approaches && (pose.is_definition || !pose.approach.isZero(0));
  }
  std::vector<Candidate> all{{"none", CompensationMethod::nominal, base, 0}};
  if (targets) {
    all.push_back({"option1", CompensationMethod::option1, base, 72});
    all.push_back({"option2", CompensationMethod::option2, base, 78});
    all.push_back({"option3", CompensationMethod::option3, base, 12});
  }
  const auto kinematic = [&](const std::string& name, int complexity, auto change) {
    IdentifyOptions options = base;
    change(options);
    all.push_back({name, CompensationMethod::kinematic, options, complexity});
  };
  if (base.geometry && base.scales) {
    kinematic("leg offsets", 6, [](IdentifyOptions& o) { o.geometry = o.scales = false; });
    kinematic("leg offsets, scales", 12, [](IdentifyOptions& o) { o.geometry = false; });
    kinematic("kinematic 42", 42, [](IdentifyOptions& o) { o.scales = false; });
  }
  kinematic("kinematic", 48, [](IdentifyOptions&) {});
  if (observations.poses.size() >= 12) {
    kinematic("kinematic + sag", 52, [](IdentifyOptions& o) { o.sag = true; });
    if (approaches) kinematic("kinematic + backlash", 54, [](IdentifyOptions& o) { o.backlash = true; });
    kinematic("kinematic + curves", 48 + 6 * kCurveTerms,
              [](IdentifyOptions& o) { o.curve_terms = kCurveTerms; });
    kinematic("kinematic + all", 58 + 6 * kCurveTerms, [&](IdentifyOptions& o) {
      o.curve_terms = kCurveTerms;
      o.sag = true;
      o.backlash = approaches;
    });
  }
  return all;
}

std::optional<FittedMethod> fit_candidate(const PlatformGeometry& nominal, const ObservationSet& observations,
                                          const Candidate& candidate, std::string* reason) {
  FittedMethod fitted;
  fitted.model.method = candidate.method;
  fitted.model.nominal = nominal;
  switch (candidate.method) {
    case CompensationMethod::nominal:
      break;
    case CompensationMethod::option1:
    case CompensationMethod::option2:
    case CompensationMethod::option3: {
      const int option = candidate.method == CompensationMethod::option1   ? 1
                         : candidate.method == CompensationMethod::option2 ? 2
                                                                           : 3;
      fitted.model.paper = fit_paper_option(nominal, option, observations.poses);
      break;
    }
    case CompensationMethod::kinematic: {
      fitted.identified = identify(nominal, observations, candidate.identify);
      if (fitted.identified->status != IdentifyStatus::identified) {
        *reason = fitted.identified->reason;
        return std::nullopt;
      }
      fitted.model.machine = fitted.identified->machine;
      break;
    }
  }
  return fitted;
}

MethodComparison compare_methods(const PlatformGeometry& nominal, const ObservationSet& observations,
                                 const std::vector<Candidate>& candidates, const ComparisonOptions& options) {
  MethodComparison comparison;
  std::size_t testable = 0;
  for (const PoseObservation& pose : observations.poses)
    if (!pose.is_definition && pose.complete()) ++testable;
  comparison.leave_one_out = static_cast<int>(testable) <= options.leave_one_out_up_to;
  comparison.folds = comparison.leave_one_out ? static_cast<int>(testable) : options.folds;
  // Options 1 to 3 know no frames but the hexapod's.
  ObservationSet seen_by_hexapod = observations;
  const bool frames_unknown = !candidates.empty() && candidates.back().identify.frames_unknown;
  if (frames_unknown) {
    const IdentifyResult identified = identify(nominal, observations, candidates.back().identify);
    if (identified.status == IdentifyStatus::identified)
      seen_by_hexapod = in_hexapod_frames(nominal, observations, identified);
  }
  const auto folds = folds_of(observations, std::max(1, comparison.folds));
  for (const Candidate& candidate : candidates) {
    const bool kinematic = candidate.method == CompensationMethod::kinematic;
    comparison.methods.push_back(
        validate(nominal, kinematic ? observations : seen_by_hexapod, candidate, folds));
  }
  const auto& methods = comparison.methods;
  const auto usable = [&](std::size_t i) { return methods[i].failure.empty() && methods[i].poses > 0; };
  for (std::size_t i = 0; i < methods.size(); ++i) {
    if (usable(i) &&
        (!usable(comparison.best) || methods[i].mean_loss_mm2() < methods[comparison.best].mean_loss_mm2()))
      comparison.best = i;
  }
  comparison.chosen = comparison.best;
  for (std::size_t i = 0; i < methods.size(); ++i) {
    if (!usable(i) || methods[i].complexity >= methods[comparison.chosen].complexity) continue;
    std::vector<double> difference;
    for (std::size_t p = 0; p < methods[i].losses_mm2.size(); ++p)
      difference.push_back(methods[i].losses_mm2[p] - methods[comparison.best].losses_mm2[p]);
    if (mean(difference) <= standard_error(difference)) comparison.chosen = i;
  }
  comparison.why = comparison.chosen == comparison.best
                       ? fmt::format("{}: least error, and nothing simpler comes within one standard error",
                                     methods[comparison.chosen].name)
                       : fmt::format("{}: the simplest within one standard error of {}",
                                     methods[comparison.chosen].name, methods[comparison.best].name);
  return comparison;
}

ObservationSet in_hexapod_frames(const PlatformGeometry& nominal, const ObservationSet& observations,
                                 const IdentifyResult& identified) {
  ObservationSet seen = observations;
  for (PoseObservation& pose : seen.poses)
    pose.measured = nominal.pose_from_B_from_P(identified.machine.geometry.B_from_P(pose.measured));
  return seen;
}

}  // namespace hexcal
