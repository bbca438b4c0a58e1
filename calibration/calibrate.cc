#include "calibration/calibrate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "calibration/unmeasured.h"
#include "kinematics/geometry/input_error.h"

namespace hexcal {
namespace {

constexpr std::size_t kFewestPoses = 4;
constexpr double kLeastTiltDeg = 0.5;

// The member of the wanted family with the least cross-validated error; extensions must earn their place.
std::size_t choose_within(const MethodComparison& comparison, const std::string& wanted) {
  const auto& methods = comparison.methods;
  std::size_t chosen = methods.size();
  for (std::size_t i = 0; i < methods.size(); ++i) {
    const bool exact = methods[i].name == (wanted == "geometry" ? "kinematic" : wanted);
    const bool extension = wanted == "kinematic" && methods[i].name.rfind("kinematic +", 0) == 0;
    if (!(exact || extension) || !methods[i].failure.empty()) continue;
    if (chosen == methods.size()) {
      chosen = i;
      continue;
    }
    double gain = 0;
    double squares = 0;
    const double n = static_cast<double>(methods[i].losses_mm2.size());
    for (const double d : loss_differences(methods[chosen], methods[i])) {
      gain += d / n;
      squares += d * d / n;
    }
    const double error = n > 1 ? std::sqrt(std::max(0.0, squares - gain * gain) / (n - 1)) : 0.0;
    if (gain > error) chosen = i;
  }
  return chosen;
}

std::vector<PaperEvaluation> evaluate_methods(const ObservationSet& observations,
                                              const MethodComparison& comparison,
                                              const ObservationSet& seen) {
  std::vector<PaperEvaluation> evaluations;
  std::vector<Target> targets;
  std::map<std::string, std::size_t> index;
  for (std::size_t i = 0; i < observations.poses.size(); ++i) {
    const PoseObservation& pose = observations.poses[i];
    index[pose.id] = i;
    if (pose.target && !pose.is_definition && pose.complete()) targets.push_back({pose.id, *pose.target});
  }
  for (std::size_t m = 0; m < comparison.methods.size(); ++m) {
    const CrossValidation& method = comparison.methods[m];
    PaperEvaluation evaluation;
    evaluation.method = method.name;
    const std::optional<FittedMethod>& fitted = comparison.fitted[m];
    std::map<std::size_t, Vector6d> after;
    for (std::size_t p = 0; p < method.held_out.size(); ++p)
      after[method.held_out_index[p]] = pose_error(method.held_out[p].actual, method.held_out[p].target);
    std::vector<PosePair> before_pairs;
    std::vector<PosePair> after_pairs;
    if (fitted && method.failure.empty()) {
      for (const CorrectedCommand& command : compensate(fitted->model, targets)) {
        if (command.status != CommandStatus::ok) {
          evaluation.dropped.push_back(command.id);
          continue;
        }
        const std::size_t i = index.at(command.id);
        if (after.count(i) == 0) continue;
        evaluation.valid.push_back(command.id);
        before_pairs.push_back({command.target, seen.poses[i].measured});
        evaluation.errors_before.push_back(pose_error(seen.poses[i].measured, command.target));
        evaluation.errors_after.push_back(after.at(i));
        for (std::size_t p = 0; p < method.held_out.size(); ++p)
          if (method.held_out_index[p] == i) after_pairs.push_back(method.held_out[p]);
      }
    }
    evaluation.before = error_statistics(before_pairs);
    evaluation.after = error_statistics(after_pairs);
    evaluations.push_back(std::move(evaluation));
  }
  return evaluations;
}

// Rows of one table stand over one set of poses: those that every method keeps in the workspace.
void evaluate_in_common(const ObservationSet& seen, CalibrationReport& report) {
  std::map<std::string, std::size_t> keepers;
  std::size_t methods = 0;
  for (std::size_t m = 0; m < report.evaluations.size(); ++m) {
    if (!report.comparison.methods[m].failure.empty()) continue;
    ++methods;
    for (const std::string& id : report.evaluations[m].valid) ++keepers[id];
  }
  std::map<std::size_t, bool> shared;
  std::vector<PosePair> before;
  for (std::size_t i = 0; i < seen.poses.size(); ++i) {
    const PoseObservation& pose = seen.poses[i];
    const auto found = keepers.find(pose.id);
    if (found == keepers.end() || found->second != methods) continue;
    shared[i] = true;
    report.common.push_back(pose.id);
    before.push_back({*pose.target, pose.measured});
  }
  report.common_before = error_statistics(before);
  for (std::size_t m = 0; m < report.evaluations.size(); ++m) {
    const CrossValidation& method = report.comparison.methods[m];
    std::vector<PosePair> after;
    for (std::size_t p = 0; p < method.held_out.size(); ++p)
      if (shared.count(method.held_out_index[p]) != 0) after.push_back(method.held_out[p]);
    report.evaluations[m].after_common = error_statistics(after);
  }
}

void require_poses(const ObservationSet& observations) {
  std::size_t count = 0;
  double spread = 0;
  bool targets = false;
  for (const PoseObservation& pose : observations.poses) {
    if (pose.is_definition) continue;
    ++count;
    spread = std::max(spread, (pose.readings - observations.poses.front().readings).cwiseAbs().maxCoeff());
  }
  if (count < kFewestPoses)
    throw InputError(
        fmt::format("{} measured poses besides home, wanted at least {} (34 are usual, 12 planned "
                    "ones may do)",
                    count, kFewestPoses));
  if (spread == 0) throw InputError("all measured poses have the same readings, wanted different poses");
  // Level poses determine 24 of 42 numbers, and none of what tilts the platform.
  double most_tilt_rad = 0;
  for (const PoseObservation& pose : observations.poses) {
    if (pose.is_definition || !pose.target) continue;
    most_tilt_rad = std::max(most_tilt_rad, tilt_rad(*pose.target));
    targets = true;
  }
  if (targets && most_tilt_rad < kLeastTiltDeg * kRadPerDeg)
    throw InputError(
        fmt::format("all poses are level (tilted by at most {:.2f} deg), wanted some tilted about x and y by "
                    "several degrees",
                    most_tilt_rad * kDegPerRad));
}

}  // namespace

CalibrationReport calibrate(const PlatformGeometry& nominal, const ObservationSet& observations,
                            const CalibrateOptions& options) {
  require_poses(observations);
  CalibrationReport report;
  const bool frames_unknown = options.identify.frames_unknown;

  std::vector<std::size_t> kept;
  std::vector<std::size_t> out;
  if (!frames_unknown) out = near_singular_outliers(nominal, observations.poses);
  for (std::size_t i = 0; i < observations.poses.size(); ++i) {
    if (std::find(out.begin(), out.end(), i) == out.end()) {
      kept.push_back(i);
    } else {
      report.outliers.push_back(observations.poses[i].id);
    }
  }
  const ObservationSet used = out.empty() ? observations : observations.subset(kept);

  // With frames that the measurement does not share with the hexapod, errors exist only after alignment.
  const ObservationSet seen = frames_unknown ? in_hexapod_frames(nominal, used) : used;
  std::vector<PosePair> pairs;
  const ObservationSet& listed = frames_unknown ? seen : observations;
  for (const PoseObservation& pose : listed.poses) {
    if (!pose.target || pose.is_definition || !pose.complete()) continue;
    report.pose_ids.push_back(pose.id);
    report.errors.push_back(pose_error(pose.measured, *pose.target));
  }

  const std::vector<Candidate> candidates = candidates_for(used, options.identify);
  report.comparison = compare_methods(nominal, used, candidates, options.comparison);
  for (const std::size_t i : report.comparison.unexplained) report.unexplained.push_back(used.poses[i].id);
  for (const PoseObservation& pose : seen.poses) {
    if (!pose.target || pose.is_definition || !pose.complete()) continue;
    if (std::ranges::find(report.unexplained, pose.id) == report.unexplained.end())
      pairs.push_back({*pose.target, pose.measured});
  }
  if (!pairs.empty()) report.uncompensated = error_statistics(pairs);
  count_unmeasured(nominal, used, frames_unknown, report.comparison);
  if (!pairs.empty()) report.evaluations = evaluate_methods(used, report.comparison, seen);
  for (std::size_t m = 0; m < report.evaluations.size(); ++m)
    report.comparison.methods[m].targets_lost = static_cast<int>(report.evaluations[m].dropped.size());
  evaluate_in_common(seen, report);
  // So far of the poses without outliers.
  for (std::size_t& i : report.comparison.unexplained) i = kept[i];
  for (CrossValidation& method : report.comparison.methods)
    for (std::size_t& i : method.held_out_index) i = kept[i];
  for (const PoseObservation& pose : used.poses) report.fitted_ids.push_back(pose.id);

  std::size_t chosen = report.comparison.chosen;
  report.why = report.comparison.why;
  if (options.method != "auto") {
    chosen = choose_within(report.comparison, options.method);
    if (chosen == candidates.size())
      throw InputError(fmt::format("method {}: cannot be fitted to these poses", options.method));
    report.why = candidates[chosen].name == options.method || options.method == "geometry"
                     ? fmt::format("{}: as asked", options.method)
                     : fmt::format("{}: as asked, and cross-validation says that the extension helps",
                                   candidates[chosen].name);
  }
  report.chosen = candidates[chosen].name;
  report.fitted = *report.comparison.fitted[chosen];  // what cannot be fitted is not chosen
  if (report.fitted.identified)
    report.identifiability = judge_identifiability(nominal, *report.fitted.identified);
  report.doubt = doubt_machine({.nominal = &nominal,
                                .observations = &used,
                                .seen = &seen,
                                .unexplained = &report.unexplained,
                                .comparison = &report.comparison,
                                .frames_unknown = frames_unknown});
  // A model that is doubted is not handed on.
  if (report.doubt) report.fitted.model = CalibrationModel{.nominal = nominal};
  return report;
}

std::vector<CorrectedCommand> corrected_commands(const CalibrationReport& report,
                                                 const std::vector<Target>& targets,
                                                 const LegVector& approach) {
  const auto& identified = report.fitted.identified;
  std::vector<CorrectedCommand> commands =
      compensate(report.fitted.model, targets, identified ? &*identified : nullptr, approach);
  if (!report.doubt) return commands;
  for (CorrectedCommand& command : commands) {
    command.status = CommandStatus::withheld;
    command.reason = "withheld: the measured poses contradict hexapod.yaml";
    command.predicted.reset();
    command.readings.reset();
    command.sigma.reset();
  }
  return commands;
}

}  // namespace hexcal
