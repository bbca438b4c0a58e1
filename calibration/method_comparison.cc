#include "calibration/method_comparison.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>

#include "kinematics/forward.h"
#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/median.h"

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

// Poses to hold out: those measured in all coordinates; where these are few, all.
std::vector<std::size_t> testable(const ObservationSet& observations) {
  std::vector<std::size_t> complete;
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < observations.poses.size(); ++i) {
    if (observations.poses[i].is_definition) continue;
    all.push_back(i);
    if (observations.poses[i].complete()) complete.push_back(i);
  }
  return 2 * complete.size() >= all.size() ? complete : all;
}

// Repeats of one pose would test what the others of them have taught. Each group holds poses whose readings
// differ from the first one's by less than a hundredth of their spread.
std::vector<std::vector<std::size_t>> groups_of(const ObservationSet& observations,
                                                const std::vector<std::size_t>& poses) {
  constexpr double kSameShare = 0.01;
  LegVector low = LegVector::Constant(std::numeric_limits<double>::infinity());
  LegVector high = -low;
  for (const std::size_t i : poses) {
    low = low.cwiseMin(observations.poses[i].readings);
    high = high.cwiseMax(observations.poses[i].readings);
  }
  const double same = kSameShare * (high - low).maxCoeff();
  std::vector<std::vector<std::size_t>> groups;
  for (const std::size_t i : poses) {
    const LegVector& readings = observations.poses[i].readings;
    const auto group = std::ranges::find_if(groups, [&](const std::vector<std::size_t>& others) {
      return (observations.poses[others.front()].readings - readings).cwiseAbs().maxCoeff() < same;
    });
    if (group == groups.end()) {
      groups.push_back({i});
    } else {
      group->push_back(i);
    }
  }
  return groups;
}

// Groups spread over the folds in the order in which they were given: fold of group i is i mod folds.
std::vector<std::vector<std::size_t>> folds_of(const std::vector<std::vector<std::size_t>>& groups,
                                               std::size_t folds) {
  std::vector<std::vector<std::size_t>> out(folds);
  for (std::size_t i = 0; i < groups.size(); ++i)
    out[i % folds].insert(out[i % folds].end(), groups[i].begin(), groups[i].end());
  return out;
}

// Coordinates that were not measured test nothing: they count as met.
Pose with_expected(const PoseObservation& pose, const Pose& expected) {
  Vector6d v = pose.measured.vector();
  for (Eigen::Index k = 0; k < 6; ++k)
    if (!pose.observed[static_cast<std::size_t>(k)]) v[k] = expected.vector()[k];
  return Pose::from_vector(v);
}

double loss_mm2(const PosePair& pair, double length_mm) {
  const double mm = (pair.actual.position_mm - pair.target.position_mm).norm();
  const double arc_mm = length_mm * rotation_distance(quaternion_from_rpy(pair.actual.rpy_rad),
                                                      quaternion_from_rpy(pair.target.rpy_rad));
  return mm * mm + arc_mm * arc_mm;
}

// What the measurement's noise alone may make of a pose's loss; nothing where it is not known.
double noise_mm2(const ObservationSet& observations, std::size_t i, double length_mm) {
  if (!observations.covariance_known) return 0;
  return squares_mm2(observations.covariance(i).diagonal().cwiseMax(0.0).cwiseSqrt(), length_mm);
}

// `of_all`: the fit to all poses, from which those to the folds begin.
CrossValidation validate(const PlatformGeometry& nominal, const ObservationSet& observations,
                         const Candidate& candidate, const std::vector<std::vector<std::size_t>>& folds,
                         std::optional<FittedMethod>& of_all) {
  CrossValidation result;
  result.name = candidate.name;
  result.method = candidate.method;
  result.complexity = candidate.complexity;
  of_all = fit_candidate(nominal, observations, candidate, &result.failure);
  if (!of_all) return result;
  const IdentifyResult* start = of_all->identified ? &*of_all->identified : nullptr;
  const double length_mm = characteristic_length_mm(nominal);
  for (const auto& held_out : folds) {
    std::vector<std::size_t> kept;
    for (std::size_t i = 0; i < observations.poses.size(); ++i)
      if (std::find(held_out.begin(), held_out.end(), i) == held_out.end()) kept.push_back(i);
    const auto fitted = fit_candidate(nominal, observations.subset(kept), candidate, &result.failure, start);
    if (!fitted) return result;
    for (const std::size_t i : held_out) {
      const PoseObservation& pose = observations.poses[i];
      const std::optional<Pose> expected = pose_for_readings(fitted->model, pose.readings, pose.approach);
      if (!expected) {
        result.without_pose.push_back(i);
        continue;
      }
      double may_be = noise_mm2(observations, i, length_mm);
      if (fitted->identified)
        may_be += squares_mm2(predicted_sigma(*fitted->identified, *expected), length_mm);
      result.expected_mm2.push_back(may_be);
      result.held_out.push_back({*expected, with_expected(pose, *expected)});
      result.held_out_index.push_back(i);
    }
  }
  if (4 * result.without_pose.size() > result.held_out.size()) {
    result.failure =
        fmt::format("no pose at the readings of '{}'", observations.poses[result.without_pose.front()].id);
  }
  return result;
}

double median_loss(const CrossValidation& method, double length_mm) {
  std::vector<double> losses;
  for (const PosePair& pair : method.held_out) losses.push_back(loss_mm2(pair, length_mm));
  return median(std::move(losses));
}

// Poses that no method explains: measured wrongly, or at other readings than the table says. Their least loss
// lies far above the others' and, by as much, above what the noise of that pose and of the fit without it may
// make it (a pose beyond all others is predicted badly by any model); more than a fifth of all are no
// exceptions. A model with as many numbers as the poses that it is fitted to have coordinates predicts a pose
// from its tolerances alone: that it fails at one accuses nobody.
std::set<std::size_t> unexplained(const std::vector<CrossValidation>& methods, double length_mm,
                                  std::size_t poses_in_fit) {
  constexpr double kFarAboveMedian = 25;  // five times the median error
  const CrossValidation* best = nullptr;
  for (const CrossValidation& method : methods) {
    if (!method.failure.empty() || method.held_out.empty()) continue;
    if (best == nullptr || median_loss(method, length_mm) < median_loss(*best, length_mm)) best = &method;
  }
  if (best == nullptr || 6 * poses_in_fit <= static_cast<std::size_t>(best->complexity)) return {};
  std::map<std::size_t, double> least;
  for (const CrossValidation& method : methods) {
    if (!method.failure.empty()) continue;
    for (std::size_t p = 0; p < method.held_out.size(); ++p) {
      const double loss = loss_mm2(method.held_out[p], length_mm);
      const auto [at, added] = least.try_emplace(method.held_out_index[p], loss);
      if (!added) at->second = std::min(at->second, loss);
    }
  }
  // Of the best method: loss over what it may be.
  std::map<std::size_t, double> excess;
  std::vector<double> ratios;
  for (std::size_t p = 0; p < best->held_out.size(); ++p) {
    const double loss = loss_mm2(best->held_out[p], length_mm);
    ratios.push_back(best->expected_mm2[p] > 0 ? loss / best->expected_mm2[p]
                                               : std::numeric_limits<double>::infinity());
    excess[best->held_out_index[p]] = ratios.back();
  }
  const double usual = std::max(1.0, median(std::move(ratios)));
  std::vector<std::pair<double, std::size_t>> worst_first;
  for (const auto& [index, loss] : least) worst_first.emplace_back(-loss, index);
  std::sort(worst_first.begin(), worst_first.end());
  std::set<std::size_t> far;
  for (const auto& [loss, index] : worst_first) {
    if (5 * (far.size() + 1) > worst_first.size() ||
        -loss <= kFarAboveMedian * -worst_first[worst_first.size() / 2].first)
      break;
    const auto ratio = excess.find(index);
    if (ratio == excess.end() || std::isinf(usual) || ratio->second > kFarAboveMedian * usual)
      far.insert(index);
  }
  return far;
}

// Weight of each pose in the choice: the inverse of what its loss is by noise and by what the best model
// lacks (the median loss beyond the noise). Equal where the noise is the same or not known.
std::map<std::size_t, double> weights_of(const ObservationSet& observations,
                                         const std::vector<std::size_t>& poses,
                                         const std::vector<CrossValidation>& methods,
                                         const std::set<std::size_t>& left_out, double length_mm) {
  double lacks_mm2 = std::numeric_limits<double>::infinity();
  for (const CrossValidation& method : methods) {
    std::vector<double> beyond;
    for (std::size_t p = 0; p < method.held_out.size(); ++p) {
      if (left_out.count(method.held_out_index[p]) != 0) continue;
      beyond.push_back(std::max(0.0, loss_mm2(method.held_out[p], length_mm) -
                                         noise_mm2(observations, method.held_out_index[p], length_mm)));
    }
    if (method.failure.empty() && !beyond.empty()) lacks_mm2 = std::min(lacks_mm2, median(std::move(beyond)));
  }
  std::map<std::size_t, double> weights;
  for (const std::size_t i : poses) {
    const double variance = lacks_mm2 + noise_mm2(observations, i, length_mm);
    weights[i] = variance > 0 && std::isfinite(variance) ? 1 / variance : 1;
  }
  return weights;
}

// Statistics of the held-out poses but those of `left_out`, which go.
void summarise(CrossValidation& result, const std::set<std::size_t>& left_out, double length_mm,
               const std::map<std::size_t, double>& weight_of) {
  std::vector<PosePair> pairs;
  std::vector<std::size_t> indices;
  std::vector<double> position_squares;
  std::vector<double> orientation_squares;
  std::vector<double> expected;
  for (std::size_t p = 0; p < result.held_out.size(); ++p) {
    if (left_out.count(result.held_out_index[p]) != 0) continue;
    const PosePair& pair = result.held_out[p];
    pairs.push_back(pair);
    indices.push_back(result.held_out_index[p]);
    result.losses_mm2.push_back(loss_mm2(pair, length_mm));
    result.weights.push_back(weight_of.at(result.held_out_index[p]));
    expected.push_back(result.expected_mm2[p]);
    position_squares.push_back((pair.actual.position_mm - pair.target.position_mm).squaredNorm());
    orientation_squares.push_back((result.losses_mm2.back() - position_squares.back()) /
                                  (length_mm * length_mm));
  }
  result.held_out = std::move(pairs);
  result.held_out_index = std::move(indices);
  result.expected_mm2 = std::move(expected);
  const double mean_weight = result.weights.empty() ? 1 : mean(result.weights);
  for (double& weight : result.weights) weight /= mean_weight;
  result.poses = static_cast<int>(result.held_out.size());
  result.errors = error_statistics(result.held_out);
  // d sqrt(m) = dm / (2 sqrt(m)).
  const auto root_error = [](const std::vector<double>& squares, double rms) {
    return rms > 0 ? standard_error(squares) / (2 * rms) : 0.0;
  };
  result.position_rms_se_mm = root_error(position_squares, result.errors.position_rms_mm);
  result.orientation_rms_se_rad = root_error(orientation_squares, result.errors.orientation_rms_rad);
}

}  // namespace

double CrossValidation::mean_loss_mm2() const {
  double sum = 0;
  for (std::size_t p = 0; p < losses_mm2.size(); ++p) sum += weights[p] * losses_mm2[p];
  return losses_mm2.empty() ? 0.0 : sum / static_cast<double>(losses_mm2.size());
}

std::vector<double> loss_differences(const CrossValidation& a, const CrossValidation& b) {
  std::vector<double> differences;
  for (std::size_t p = 0; p < a.losses_mm2.size(); ++p)
    differences.push_back(a.weights[p] * (a.losses_mm2[p] - b.losses_mm2[p]));
  return differences;
}

std::vector<Candidate> candidates_for(const ObservationSet& observations, const IdentifyOptions& base) {
  std::size_t complete = 0;
  bool targets = !observations.poses.empty();
  bool approaches = !observations.poses.empty();
  for (const PoseObservation& pose : observations.poses) {
    if (!pose.is_definition) targets = targets && pose.target.has_value();
    complete += pose.complete() ? 1 : 0;
    approaches = approaches && (pose.is_definition || !pose.approach.isZero(0));
  }
  std::vector<Candidate> all{{"none", CompensationMethod::nominal, base, 0}};
  if (targets && 2 * complete >= observations.poses.size()) {
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
                                          const Candidate& candidate, std::string* reason,
                                          const IdentifyResult* start) {
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
      fitted.identified = identify(nominal, observations, candidate.identify, start);
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
  const std::vector<std::size_t> poses = testable(observations);
  const std::vector<std::vector<std::size_t>> groups = groups_of(observations, poses);
  comparison.leave_one_out = static_cast<int>(groups.size()) <= options.leave_one_out_up_to;
  comparison.folds = comparison.leave_one_out ? static_cast<int>(groups.size()) : options.folds;
  // Options 1 to 3 know no frames but the hexapod's.
  const bool frames_unknown = !candidates.empty() && candidates.back().identify.frames_unknown;
  const ObservationSet seen_by_hexapod =
      frames_unknown ? in_hexapod_frames(nominal, observations) : observations;
  const auto folds = folds_of(groups, static_cast<std::size_t>(std::max(1, comparison.folds)));
  comparison.methods.resize(candidates.size());
  comparison.fitted.resize(candidates.size());
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, candidates.size(), 1),
      [&](const tbb::blocked_range<std::size_t>& range) {
        for (std::size_t c = range.begin(); c < range.end(); ++c) {
          const bool kinematic = candidates[c].method == CompensationMethod::kinematic;
          comparison.methods[c] = validate(nominal, kinematic ? observations : seen_by_hexapod, candidates[c],
                                           folds, comparison.fitted[c]);
        }
      },
      tbb::simple_partitioner());
  const double length_mm = characteristic_length_mm(nominal);
  std::set<std::size_t> left_out =
      unexplained(comparison.methods, length_mm,
                  poses.size() - (poses.size() + folds.size() - 1) / std::max<std::size_t>(1, folds.size()));
  // All methods are compared over one set of poses.
  for (const CrossValidation& method : comparison.methods)
    if (method.failure.empty()) left_out.insert(method.without_pose.begin(), method.without_pose.end());
  comparison.unexplained.assign(left_out.begin(), left_out.end());
  const std::map<std::size_t, double> weights =
      weights_of(observations, poses, comparison.methods, left_out, length_mm);
  for (CrossValidation& method : comparison.methods) summarise(method, left_out, length_mm, weights);
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
    const std::vector<double> difference = loss_differences(methods[i], methods[comparison.best]);
    if (mean(difference) <= standard_error(difference)) comparison.chosen = i;
  }
  comparison.why = comparison.chosen == comparison.best
                       ? fmt::format("{}: least error, and nothing simpler comes within one standard error",
                                     methods[comparison.chosen].name)
                       : fmt::format("{}: the simplest within one standard error of {}",
                                     methods[comparison.chosen].name, methods[comparison.best].name);
  return comparison;
}

ObservationSet in_hexapod_frames(const PlatformGeometry& nominal, const ObservationSet& observations) {
  IdentifyOptions frames_only;
  frames_only.frames_unknown = true;
  frames_only.geometry = frames_only.scales = false;
  for (int leg = 0; leg < 6; ++leg)
    frames_only.fixed.insert(parameter_name({}, ParameterLayout::kPerLeg * leg + 6));  // offsets
  const IdentifyResult identified = identify(nominal, observations, frames_only);
  if (identified.status != IdentifyStatus::identified) throw InputError(identified.reason);
  ObservationSet seen = observations;
  for (PoseObservation& pose : seen.poses) {
    Pose measured = pose.measured;
    if (!pose.complete()) {
      const CalibrationModel model{.method = CompensationMethod::kinematic,
                                   .nominal = nominal,
                                   .paper = {},
                                   .machine = identified.machine};
      const auto expected = pose_for_readings(model, pose.readings);
      if (expected) measured = with_expected(pose, *expected);
    }
    pose.measured = nominal.pose_from_B_from_P(identified.machine.geometry.B_from_P(measured));
  }
  return seen;
}

}  // namespace hexcal
