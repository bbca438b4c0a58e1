#include "calibration/plan_poses.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <random>

#include "calibration/free_parameters.h"
#include "calibration/leg_residuals.h"
#include "calibration/normal_equations.h"
#include "kinematics/geometry/input_error.h"
#include "kinematics/inverse.h"
#include "kinematics/sampling.h"

namespace hexcal {
namespace {

using Whitened = Eigen::Matrix<double, 6, Eigen::Dynamic>;

// Whitened Jacobians of poses by the free parameters, these in units of their tolerances.
class Design {
 public:
  Design(const PlatformGeometry& nominal, const PlanOptions& options)
      : nominal_(nominal),
        options_(options),
        free_(free_parameters(options.identify)),
        scales_(free_.tolerances.cwiseMin(free_.widest)) {
    LegVector shortest;
    LegVector longest;
    for (std::size_t k = 0; k < 6; ++k) {
      shortest[static_cast<Eigen::Index>(k)] = nominal.actuators[k].min_mm;
      longest[static_cast<Eigen::Index>(k)] = nominal.actuators[k].max_mm;
    }
    stroke_range_ << readings_from_lengths(nominal, shortest), readings_from_lengths(nominal, longest);
  }

  Eigen::Index parameters() const { return free_.selection.free_count; }

  Whitened measured(const Pose& pose) const {
    const auto [reduced, by_pose] = reduced_at(pose);
    Matrix6d covariance = by_pose * variance().asDiagonal() * by_pose.transpose();
    covariance.diagonal().array() += options_.identify.leg_sigma_mm * options_.identify.leg_sigma_mm;
    return Eigen::LLT<Matrix6d>(covariance).matrixL().solve(reduced);
  }

  // Jacobian of the pose (mm and rad) by the parameters.
  Whitened pose_error(const Pose& pose) const {
    const auto [reduced, by_pose] = reduced_at(pose);
    return by_pose.partialPivLu().solve(reduced);
  }

 private:
  Vector6d variance() const {
    Vector6d v;
    const double rad = options_.orientation_sigma_deg * kRadPerDeg;
    v << Eigen::Vector3d::Constant(options_.position_sigma_mm * options_.position_sigma_mm),
        Eigen::Vector3d::Constant(rad * rad);
    return v;
  }

  std::pair<Whitened, Matrix6d> reduced_at(const Pose& pose) const {
    const MachineModel machine{.geometry = nominal_};
    const LegLinearization legs = linearize_legs(machine, machine, free_.layout, stroke_range_, pose,
                                                 machine_readings(machine, pose), LegVector::Zero());
    ReducedPose reduced = reduce_to_observed(legs, {true, true, true, true, true, true}, free_.selection);
    reduced.jacobian *= scales_.asDiagonal();
    return {reduced.jacobian, legs.by_pose};
  }

  const PlatformGeometry& nominal_;
  const PlanOptions& options_;
  FreeParameters free_;
  Eigen::VectorXd scales_;
  Eigen::Matrix<double, 6, 2> stroke_range_;
};

Eigen::MatrixXd covariance_of(const std::vector<Whitened>& design, const std::vector<std::size_t>& chosen,
                              Eigen::Index parameters) {
  Eigen::MatrixXd information = Eigen::MatrixXd::Identity(parameters, parameters);
  for (const std::size_t i : chosen) information.noalias() += design[i].transpose() * design[i];
  return information.llt().solve(Eigen::MatrixXd::Identity(parameters, parameters));
}

// What adding (sign +1) or removing (-1) a pose does to the criterion; larger is better.
class Criterion {
 public:
  Criterion(PlanCriterion kind, const Eigen::MatrixXd& interest) : kind_(kind), interest_(interest) {}

  double gain(const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& weighted, const Whitened& pose,
              double sign) const {
    const Eigen::Matrix<double, Eigen::Dynamic, 6> spread = covariance * pose.transpose();
    const Matrix6d inner = Matrix6d::Identity() + sign * pose * spread;
    const Eigen::LLT<Matrix6d> llt(inner);
    if (llt.info() != Eigen::Success) return -std::numeric_limits<double>::infinity();
    if (kind_ == PlanCriterion::d_optimal)
      return 2.0 * Matrix6d(llt.matrixL()).diagonal().array().log().sum();
    // trace(B S) falls by trace(spread^T B spread inner^-1), with weighted = covariance B covariance.
    const Matrix6d through = pose * weighted * pose.transpose();
    return sign * llt.solve(through).trace();
  }

  Eigen::MatrixXd weighted(const Eigen::MatrixXd& covariance) const {
    return kind_ == PlanCriterion::d_optimal ? Eigen::MatrixXd()
                                             : Eigen::MatrixXd(covariance * interest_ * covariance);
  }

 private:
  PlanCriterion kind_;
  const Eigen::MatrixXd& interest_;
};

// The candidates that would help most beside those chosen.
std::vector<std::size_t> shortlist(const std::vector<Whitened>& measured, const Criterion& criterion,
                                   const Eigen::MatrixXd& covariance) {
  constexpr std::size_t kShortlisted = 50;
  const Eigen::MatrixXd weighted = criterion.weighted(covariance);
  std::vector<std::pair<double, std::size_t>> by_gain;
  for (std::size_t i = 0; i < measured.size(); ++i)
    by_gain.emplace_back(-criterion.gain(covariance, weighted, measured[i], 1.0), i);
  std::sort(by_gain.begin(), by_gain.end());
  std::vector<std::size_t> best;
  for (std::size_t k = 0; k < std::min(kShortlisted, by_gain.size()); ++k) best.push_back(by_gain[k].second);
  return best;
}

// Each pose in turn goes, and the one that then helps most comes, until a whole round changes nothing. Of the
// candidates the most helpful ones are looked at, anew in each round.
void exchange(PosePlan& plan, const std::vector<Whitened>& measured, const Criterion& criterion,
              int max_exchanges, Eigen::Index parameters) {
  bool changed = true;
  while (changed && plan.exchanges < max_exchanges) {
    changed = false;
    const std::vector<std::size_t> best =
        shortlist(measured, criterion, covariance_of(measured, plan.chosen, parameters));
    for (std::size_t k = 0; k < plan.chosen.size(); ++k) {
      std::vector<std::size_t> others = plan.chosen;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
      const Eigen::MatrixXd covariance = covariance_of(measured, others, parameters);
      const Eigen::MatrixXd weighted = criterion.weighted(covariance);
      std::size_t next = plan.chosen[k];
      double most = criterion.gain(covariance, weighted, measured[next], 1.0);
      most += 1e-6 * std::abs(most);
      for (const std::size_t i : best) {
        if (std::find(plan.chosen.begin(), plan.chosen.end(), i) != plan.chosen.end()) continue;
        const double gain = criterion.gain(covariance, weighted, measured[i], 1.0);
        if (gain <= most) continue;
        most = gain;
        next = i;
      }
      if (next == plan.chosen[k]) continue;
      plan.chosen[k] = next;
      ++plan.exchanges;
      changed = true;
    }
  }
}

PredictedError predict(const std::vector<Whitened>& errors, const Eigen::MatrixXd& covariance,
                       std::size_t poses) {
  PredictedError predicted;
  predicted.poses = poses;
  for (const Whitened& j : errors) {
    const Matrix6d c = j * covariance * j.transpose();
    predicted.position_mm += c.diagonal().head<3>().sum();
    predicted.orientation_rad += c.diagonal().tail<3>().sum();
  }
  const double n = std::max<double>(1.0, static_cast<double>(errors.size()));
  predicted.position_mm = std::sqrt(predicted.position_mm / n);
  predicted.orientation_rad = std::sqrt(predicted.orientation_rad / n);
  return predicted;
}

}  // namespace

void PlanOptions::validate() const {
  const auto positive = [](double value, const char* field) {
    if (!(value > 0)) throw InputError(fmt::format("{}: found {}, wanted more than 0", field, value));
  };
  positive(static_cast<double>(count), "count");
  positive(position_sigma_mm, "position_sigma_mm");
  positive(orientation_sigma_deg, "orientation_sigma_deg");
  identify.validate();
}

std::vector<Pose> planning_candidates(const PlatformGeometry& nominal, std::size_t count, std::uint64_t seed,
                                      double max_tilt_rad) {
  // Not quite to the limit: the real machine is not the drawing.
  constexpr double kShareOfWay = 0.85;
  const RestState rest(nominal);
  const PoseBox box = workspace_box(nominal);
  const Vector6d half = 0.5 * (box.upper - box.lower);
  std::mt19937_64 rng(seed);
  const auto centred = [&rng] { return static_cast<double>(rng()) * 0x1p-63 - 1; };
  std::vector<Pose> poses;
  for (std::size_t attempt = 0; attempt < 20 * count && poses.size() < count; ++attempt) {
    Vector6d direction;
    for (Eigen::Index k = 0; k < 6; ++k) direction[k] = half[k] * centred();
    const double reach = reach_along(nominal, rest, Pose{}, direction, 5.0, {}, 16);
    Pose pose = Pose::from_vector(kShareOfWay * reach * direction);
    for (int shrink = 0; shrink < 8 && tilt_rad(pose) > max_tilt_rad; ++shrink)
      pose = Pose::from_vector(0.8 * pose.vector());
    // The workspace need not be a star: what lies on the way is tested once more.
    if (reach > 0 && tilt_rad(pose) <= max_tilt_rad &&
        inverse_kinematics(nominal, rest, nominal.B_from_P(pose)).reachable())
      poses.push_back(pose);
  }
  return poses;
}

PosePlan plan_poses(const PlatformGeometry& nominal, const std::vector<Pose>& candidates,
                    const std::vector<Pose>& load_paths, const PlanOptions& options) {
  options.validate();
  if (candidates.size() < options.count)
    throw InputError(fmt::format("{} candidate poses, wanted at least the {} to choose", candidates.size(),
                                 options.count));
  const Design design(nominal, options);
  std::vector<Whitened> measured;
  for (const Pose& pose : candidates) measured.push_back(design.measured(pose));
  std::vector<Whitened> errors;
  constexpr std::size_t kMostEvaluated = 200;
  const std::vector<Pose>& where = load_paths.empty() ? candidates : load_paths;
  const std::size_t stride = std::max<std::size_t>(1, where.size() / kMostEvaluated);
  for (std::size_t i = 0; i < where.size(); i += stride) errors.push_back(design.pose_error(where[i]));
  // Rotations count as arcs at the platform's size.
  const double length = characteristic_length_mm(nominal);
  Eigen::MatrixXd interest = Eigen::MatrixXd::Zero(design.parameters(), design.parameters());
  for (const Whitened& j : errors) {
    Whitened weighed = j;
    weighed.bottomRows<3>() *= length;
    interest.noalias() += weighed.transpose() * weighed / static_cast<double>(errors.size());
  }
  const Criterion criterion(options.criterion, interest);

  PosePlan plan;
  Eigen::MatrixXd covariance = covariance_of(measured, {}, design.parameters());
  // Greedy, and lazily so (Minoux 1978): what a pose adds only shrinks as others come, so that those whose
  // gain was small before need not be looked at again.
  struct Candidate {
    double gain;
    std::size_t index, chosen_then;
    bool operator<(const Candidate& other) const {
      return gain < other.gain || (gain == other.gain && index > other.index);
    }
  };
  std::priority_queue<Candidate> queue;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    queue.push({std::numeric_limits<double>::infinity(), i, options.count});
  }
  while (plan.chosen.size() < options.count) {
    const Eigen::MatrixXd weighted = criterion.weighted(covariance);
    while (queue.top().chosen_then != plan.chosen.size()) {
      const std::size_t i = queue.top().index;
      queue.pop();
      queue.push({criterion.gain(covariance, weighted, measured[i], 1.0), i, plan.chosen.size()});
    }
    plan.chosen.push_back(queue.top().index);
    queue.pop();
    covariance = covariance_of(measured, plan.chosen, design.parameters());
  }
  exchange(plan, measured, criterion, options.max_exchanges, design.parameters());
  // In the order in which they help, so that one may stop early.
  std::vector<std::size_t> pool = plan.chosen;
  plan.chosen.clear();
  covariance = covariance_of(measured, {}, design.parameters());
  while (!pool.empty()) {
    const Eigen::MatrixXd weighted = criterion.weighted(covariance);
    const auto best = std::max_element(pool.begin(), pool.end(), [&](std::size_t a, std::size_t b) {
      return criterion.gain(covariance, weighted, measured[a], 1.0) <
             criterion.gain(covariance, weighted, measured[b], 1.0);
    });
    plan.chosen.push_back(*best);
    pool.erase(best);
    covariance = covariance_of(measured, plan.chosen, design.parameters());
    plan.by_count.push_back(predict(errors, covariance, plan.chosen.size()));
    std::vector<std::size_t> random(plan.chosen.size());
    for (std::size_t i = 0; i < random.size(); ++i) random[i] = i;
    plan.random_by_count.push_back(
        predict(errors, covariance_of(measured, random, design.parameters()), random.size()));
  }
  return plan;
}

}  // namespace hexcal
