#include "calibration/identify.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>
#include <limits>

#include "calibration/frame_alignment.h"
#include "calibration/free_parameters.h"
#include "calibration/normal_equations.h"
#include "kinematics/geometry/covariance.h"
#include "kinematics/geometry/input_error.h"
#include "kinematics/screw.h"

namespace hexcal {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// 99.9 % point of chi squared with 6 degrees of freedom, and its median.
constexpr double kOutlierSquares = 22.46;
constexpr double kMedianSquares = 5.348;
constexpr int kMinPosesForRobust = 10;
// Share of the residuals' variance below which leg noise is not worth another iteration, and change of a
// noise or a tolerance (logarithm) that counts as none.
constexpr double kSmallShare = 0.02;
constexpr double kSettled = 0.02;
constexpr double kGuessedLegSigmaMm = 0.1;
// Standard deviations that an excess of the residuals must have to be one.
constexpr double kSignificant = 1;

// Curves of all legs run over the same part of the stroke, the part that any leg used: only so have they
// something in common.
Eigen::Matrix<double, 6, 2> stroke_range_of(const PlatformGeometry& nominal,
                                            const ObservationSet& observations) {
  double low = kInfinity;
  double high = -kInfinity;
  for (const PoseObservation& pose : observations.poses) {
    const LegVector lengths = lengths_from_readings(nominal, pose.readings);
    for (std::size_t k = 0; k < 6; ++k) {
      const double stroke = lengths[static_cast<Eigen::Index>(k)] - nominal.actuators[k].min_mm;
      low = std::min(low, stroke);
      high = std::max(high, stroke);
    }
  }
  LegVector shortest;
  for (std::size_t k = 0; k < 6; ++k) shortest[static_cast<Eigen::Index>(k)] = nominal.actuators[k].min_mm;
  Eigen::Matrix<double, 6, 2> range;
  range << readings_from_lengths(nominal, shortest + LegVector::Constant(low)),
      readings_from_lengths(nominal, shortest + LegVector::Constant(high));
  return range;
}

// Why the observations cannot be used at all; empty if they can.
std::string unusable(const ObservationSet& observations) {
  if (observations.poses.empty()) return "there are no poses";
  for (std::size_t i = 0; i < observations.poses.size(); ++i) {
    const PoseObservation& pose = observations.poses[i];
    const Vector6d measured = pose.measured.vector();
    for (Eigen::Index k = 0; k < 6; ++k) {
      if (!std::isfinite(pose.readings[k])) {
        return fmt::format("pose {}: found {} as reading q{}, wanted a number", pose.id, pose.readings[k],
                           k + 1);
      }
      if (pose.observed[static_cast<std::size_t>(k)] && !std::isfinite(measured[k])) {
        return fmt::format("pose {}: found {} as measured coordinate {}, wanted a number", pose.id,
                           measured[k], k + 1);
      }
    }
    if (!observations.covariance(i).allFinite()) {
      return fmt::format("pose {}: its covariance is not finite", pose.id);
    }
  }
  return "";
}

// The state of one identification.
class Identification {
 public:
  Identification(const PlatformGeometry& nominal, const ObservationSet& observations,
                 const IdentifyOptions& options)
      : drawing_(nominal), observations_(observations), options_(options) {
    nominal_.geometry = nominal;
    if (options.screw_lead && !nominal.screw)
      nominal_.geometry.screw = screw_with_tangential_axes(nominal, 0.0);
    const FreeParameters free = free_parameters(options);
    result_.layout = free.layout;
    result_.selection = free.selection;
    result_.tolerances = initial_tolerances_ = free.tolerances;
    kinds_ = free.kinds;
    frame_steps_ = free.widest;
    result_.corrections.setZero(result_.layout.size());
    result_.weights.assign(observations.poses.size(), 1.0);
    // With nothing known, all noises begin at a size that all of them may have.
    const bool known = observations.covariance_known || !options.estimate_leg_sigma;
    noise_.leg_sigma_mm = known ? options.leg_sigma_mm : kGuessedLegSigmaMm;
    result_.stroke_range = stroke_range_of(nominal, observations);
  }

  IdentifyResult run(const IdentifyResult* start) {
    if (start != nullptr) {
      begin_at(*start);
    } else if (options_.frames_unknown) {
      const auto frames = align_frames(nominal_.geometry, observations_);
      if (!frames) {
        result_.reason = "the frames of the measured poses cannot be aligned with the hexapod's";
        return result_;
      }
      nominal_.geometry.B_from_UG = frames->B_from_UG;
      nominal_.geometry.P_from_LG = frames->P_from_LG;
    }
    filled_.resize(observations_.poses.size());
    for (std::size_t i = 0; i < filled_.size(); ++i) filled_[i] = observations_.poses[i].measured;
    // The parameters converge first, then the noise beside them, then the tolerances beside both: residuals
    // of a fit that has not converged would pass for noise, and noise for tolerances that are too wide.
    // Tolerances come first, once: what tolerances that are too narrow leave would pass for noise, and noise
    // of that size for a reason to keep them narrow.
    enum class Phase { parameters, first_tolerances, noise, tolerances, settled };
    Phase phase = Phase::parameters;
    int in_phase = 0;
    for (int i = 1; i <= options_.max_iterations; ++i) {
      result_.iterations = i;
      const bool hyper = phase != Phase::parameters && phase != Phase::settled;
      adapt_tolerances_ = options_.adapt_tolerances && hyper && phase != Phase::noise;
      adapt_noise_ = hyper && phase != Phase::first_tolerances;
      if (!linearize() || !step(hyper)) return result_;
      ++in_phase;
      const auto advance = [&](Phase next) {
        phase = next;
        in_phase = 0;
      };
      switch (phase) {
        case Phase::parameters:
          if (step_squares_ < 1e-3 * rows_ || in_phase == 12)
            advance(start == nullptr ? Phase::first_tolerances : Phase::noise);
          break;
        case Phase::first_tolerances:
          if (hyper_change_ < 0.05 || in_phase == 15) advance(Phase::noise);
          break;
        case Phase::noise:
          if (hyper_change_ < 0.05 || in_phase == 10) advance(Phase::tolerances);
          break;
        case Phase::tolerances:
          if (hyper_change_ < kSettled || in_phase == 60) advance(Phase::settled);
          break;
        case Phase::settled:
          if (step_squares_ < 1e-16 * std::max(1.0, rows_)) {
            finish();
            return result_;
          }
          break;
      }
    }
    if (step_squares_ < 1e-6 * rows_) {
      finish();
    } else {
      result_.reason = fmt::format("no convergence in {} iterations", options_.max_iterations);
    }
    return result_;
  }

 private:
  int free_count() const { return result_.selection.free_count; }

  // Begins where another identification with the same nominal machine and options ended.
  void begin_at(const IdentifyResult& start) {
    nominal_.geometry.B_from_UG = start.machine.geometry.B_from_UG;
    nominal_.geometry.P_from_LG = start.machine.geometry.P_from_LG;
    result_.corrections = start.corrections;
    result_.tolerances = start.tolerances;
    noise_.leg_sigma_mm = start.leg_sigma_mm;
  }

  bool linearize() {
    result_.machine = corrected_machine(nominal_, result_.layout, result_.corrections, result_.stroke_range);
    legs_.clear();
    reduced_.clear();
    for (std::size_t i = 0; i < observations_.poses.size(); ++i) {
      const PoseObservation& pose = observations_.poses[i];
      fill_missing(i);
      const LegLinearization& legs =
          legs_.emplace_back(linearize_legs(result_.machine, nominal_, result_.layout, result_.stroke_range,
                                            filled_[i], pose.readings, pose.approach));
      if (!legs.residuals_mm.allFinite() || !legs.jacobian.allFinite()) {
        result_.reason = fmt::format("pose {}: its legs have no finite lengths there", pose.id);
        return false;
      }
      reduced_.push_back(reduce_to_observed(legs, pose.observed, result_.selection));
    }
    return true;
  }

  // Coordinates that were not measured take the value at which the legs fit best, to first order.
  void fill_missing(std::size_t i) {
    const PoseObservation& pose = observations_.poses[i];
    if (pose.complete()) return;
    // At first from the drawing's idea of where the platform stands, which knows no measuring frame.
    const Pose start =
        result_.iterations > 1
            ? filled_[i]
            : result_.machine.geometry.pose_from_B_from_P(drawing_.B_from_P(pose.target.value_or(Pose{})));
    const auto modelled = machine_pose(result_.machine, pose.readings, start, pose.approach);
    if (!modelled) return;
    Vector6d v = pose.measured.vector();
    for (Eigen::Index k = 0; k < 6; ++k)
      if (!pose.observed[static_cast<std::size_t>(k)]) v[k] = modelled->vector()[k];
    filled_[i] = Pose::from_vector(v);
  }

  // One Gauss-Newton step; afterwards, where asked, one update of weights, noise and tolerances.
  bool step(bool hyper) {
    const NormalEquationsRequest request{.components = hyper, .information_of_pose = false};
    equations_ = normal_equations(reduced_, observations_, result_.weights, noise_, request);
    rows_ = equations_.rows;
    Eigen::VectorXd prior_gradient = Eigen::VectorXd::Zero(free_count());
    Eigen::MatrixXd information = equations_.information;
    Eigen::VectorXd at = free_corrections();
    for (Eigen::Index j = 0; j < free_count(); ++j) {
      if (!std::isfinite(result_.tolerances[j])) {
        // A frame that nothing determines (positions alone do not tell how the target is turned) stays.
        information(j, j) += 1.0 / (frame_steps_[j] * frame_steps_[j]);
        continue;
      }
      const double weight = 1.0 / (result_.tolerances[j] * result_.tolerances[j]);
      information(j, j) += weight;
      prior_gradient[j] = weight * at[j];
    }
    // Scaled to unit diagonal: millimetres, relative scales and radians differ by orders of magnitude.
    const Eigen::VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = scale.asDiagonal() * information * scale.asDiagonal();
    const Eigen::LDLT<Eigen::MatrixXd> ldlt(scaled);
    const Eigen::VectorXd delta =
        -(scale.asDiagonal() * ldlt.solve(scale.asDiagonal() * (equations_.gradient + prior_gradient)));
    if (!delta.allFinite()) {
      result_.reason = "the equations have no finite solution";
      return false;
    }
    step_squares_ = delta.dot(information * delta);
    covariance_ = scale.asDiagonal() * ldlt.solve(Eigen::MatrixXd::Identity(free_count(), free_count())) *
                  scale.asDiagonal();
    if (hyper) update_noise_and_tolerances(at);
    for (int i = 0; i < result_.layout.size(); ++i) {
      const int free = result_.selection.free_of[static_cast<std::size_t>(i)];
      if (free >= 0) result_.corrections[i] += delta[free];
    }
    absorb_frames();
    return true;
  }

  // Perturbations of the frames move into the nominal frames, where the next step linearises.
  void absorb_frames() {
    if (!options_.frames_unknown) return;
    auto base = result_.corrections.segment<6>(ParameterLayout::kBaseFrame);
    auto grip = result_.corrections.segment<6>(ParameterLayout::kGripFrame);
    nominal_.geometry.B_from_UG = perturbed(nominal_.geometry.B_from_UG, base);
    nominal_.geometry.P_from_LG = perturbed(nominal_.geometry.P_from_LG, grip);
    base.setZero();
    grip.setZero();
  }

  Eigen::VectorXd free_corrections() const {
    Eigen::VectorXd at = Eigen::VectorXd::Zero(free_count());
    for (int i = 0; i < result_.layout.size(); ++i) {
      const int free = result_.selection.free_of[static_cast<std::size_t>(i)];
      if (free >= 0) at[free] = result_.corrections[i];
    }
    return at;
  }

  void update_noise_and_tolerances(const Eigen::VectorXd& at) {
    hyper_change_ = 0;
    const auto scaled_by = [&](double& value, double factor, double low, double high) {
      const double next = std::clamp(value * std::sqrt(std::clamp(factor, 1e-8, 1e8)), low, high);
      if (value > 0) hyper_change_ = std::max(hyper_change_, std::abs(std::log(next / value)));
      value = next;
    };
    update_weights();
    // Without redundancy the residuals say nothing about noise.
    const double redundancy = equations_.rows - equations_.information.cwiseProduct(covariance_).sum();
    if (adapt_noise_ && redundancy > 3) {
      if (!observations_.covariance_known) {
        scaled_by(noise_.position_factor, equations_.position.factor(covariance_), 1e-6, 1e6);
        scaled_by(noise_.orientation_factor, equations_.orientation.factor(covariance_), 1e-6, 1e6);
        // The legs' noise looks otherwise than the measurement's: it has no stiff and no soft directions.
        if (options_.estimate_leg_sigma)
          scaled_by(noise_.leg_sigma_mm, equations_.leg.factor(covariance_), 1e-4, 1e3);
      } else if (options_.estimate_leg_sigma) {
        // Foerstner's factor belongs to a component that makes up all of the noise. Where it is a part, the
        // same excess of the residuals needs a larger step.
        const double factor = equations_.leg.factor(covariance_);
        const double share = equations_.leg.trace / std::max(1e-300, equations_.rows);
        const double step = factor > 1 ? 1 + (factor - 1) / std::min(1.0, share) : factor;
        // Where measuring noise is nearly all there is, the legs' own differs in nothing, and an excess that
        // may be chance is no reason to raise it.
        const bool by_chance = factor < 1 + kSignificant * std::sqrt(2 / redundancy);
        if (share >= kSmallShare || !by_chance)
          scaled_by(noise_.leg_sigma_mm, step, 0.01 * options_.leg_sigma_mm, 1e3);
      }
    }
    if (!adapt_tolerances_) return;
    for (const ParameterKind kind :
         {ParameterKind::joint, ParameterKind::offset, ParameterKind::scale, ParameterKind::curve,
          ParameterKind::common_curve, ParameterKind::sag, ParameterKind::backlash}) {
      double determined = 0;
      double squares = 0;
      for (Eigen::Index j = 0; j < free_count(); ++j) {
        if (kinds_[static_cast<std::size_t>(j)] != kind) continue;
        const double t = result_.tolerances[j];
        determined += std::max(0.0, 1.0 - covariance_(j, j) / (t * t));
        squares += at[j] * at[j] / (t * t);
      }
      if (determined < 2) continue;  // too little evidence to judge a tolerance
      double factor = 1;
      scaled_by(factor, squares / determined, 0.2, 5);
      for (Eigen::Index j = 0; j < free_count(); ++j) {
        if (kinds_[static_cast<std::size_t>(j)] != kind) continue;
        result_.tolerances[j] = std::clamp(result_.tolerances[j] * factor, 0.01 * initial_tolerances_[j],
                                           20 * initial_tolerances_[j]);
      }
    }
  }

  // Redescending weights; the scale follows the median, so that a model that lacks something everywhere does
  // not lose half of its poses.
  void update_weights() {
    const std::size_t n = observations_.poses.size();
    if (!options_.robust || n < kMinPosesForRobust) return;
    std::vector<double> normed(n);
    for (std::size_t i = 0; i < n; ++i)
      normed[i] = equations_.squares_of_pose[i] * 6.0 / static_cast<double>(reduced_[i].residuals.size());
    std::vector<double> sorted = normed;
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(n / 2), sorted.end());
    // Where the noise is estimated, bad poses raise the estimate: the median alone tells the scale.
    const double least = observations_.covariance_known ? 1.0 : 0.0;
    const double limit = kOutlierSquares * std::max(least, sorted[n / 2] / kMedianSquares);
    for (std::size_t i = 0; i < n; ++i) {
      const double share = limit / normed[i];
      result_.weights[i] = observations_.poses[i].is_definition || share >= 1 ? 1.0 : share * share;
    }
  }

  void finish() {
    linearize();
    equations_ = normal_equations(reduced_, observations_, result_.weights, noise_,
                                  {.components = false, .information_of_pose = true});
    result_.status = IdentifyStatus::identified;
    result_.reason.clear();
    result_.covariance = covariance_;
    result_.data_information = equations_.information;
    result_.effective_parameters = equations_.information.cwiseProduct(covariance_).sum();
    const double redundancy = std::max(1.0, equations_.rows - result_.effective_parameters);
    result_.sigma0 = std::sqrt(equations_.squares / redundancy);
    LegNoise measured_only = noise_;
    measured_only.leg_sigma_mm = std::min(noise_.leg_sigma_mm, options_.leg_sigma_mm);
    result_.sigma0_of_measurement = std::sqrt(
        normal_equations(reduced_, observations_, result_.weights, measured_only).squares / redundancy);
    result_.leg_sigma_mm = noise_.leg_sigma_mm;
    double position = 0;
    double orientation = 0;
    const double n = static_cast<double>(observations_.poses.size());
    for (std::size_t i = 0; i < observations_.poses.size(); ++i) {
      const Matrix6d noise = pose_covariance(observations_, i, noise_);
      position += noise.diagonal().head<3>().sum() / (3 * n);
      orientation += noise.diagonal().tail<3>().sum() / (3 * n);
      result_.leg_residuals_mm.push_back(legs_[i].residuals_mm);
      result_.pose_residuals.emplace_back(legs_[i].by_pose.partialPivLu().solve(legs_[i].residuals_mm));
      result_.influence.push_back(equations_.information_of_pose[i].cwiseProduct(covariance_).sum() /
                                  std::max(1e-300, result_.effective_parameters));
    }
    result_.drift = find_drift();
    result_.position_sigma_mm = std::sqrt(position);
    result_.orientation_sigma_rad = std::sqrt(orientation);
  }

  // Score test of six more numbers, motions of B_from_UG in proportion to the order of the poses, at the
  // solution: what one more Gauss-Newton step would find, with all other parameters free to follow.
  std::optional<Drift> find_drift() const {
    constexpr double kByChance = 1e-4;
    constexpr std::size_t kFewestPoses = 8;
    const std::size_t n = observations_.poses.size();
    if (n < kFewestPoses || equations_.rows < result_.effective_parameters + 12) return std::nullopt;
    std::vector<ReducedPose> extended;
    ParameterSelection frame_only;
    frame_only.free_of.assign(static_cast<std::size_t>(result_.layout.size()), -1);
    frame_only.free_count = 6;
    for (int k = 0; k < 6; ++k)
      frame_only.free_of[static_cast<std::size_t>(ParameterLayout::kBaseFrame + k)] = k;
    for (std::size_t i = 0; i < n; ++i) {
      ReducedPose reduced = reduced_[i];
      const double order = 2 * static_cast<double>(i) / static_cast<double>(n - 1) - 1;
      reduced.jacobian.conservativeResize(Eigen::NoChange, free_count() + 6);
      reduced.jacobian.rightCols<6>() =
          order * reduce_to_observed(legs_[i], observations_.poses[i].observed, frame_only).jacobian;
      extended.push_back(std::move(reduced));
    }
    const NormalEquations all = normal_equations(extended, observations_, result_.weights, noise_);
    const Eigen::MatrixXd across = all.information.topRightCorner(free_count(), 6);
    const Matrix6d schur =
        all.information.bottomRightCorner<6, 6>() - across.transpose() * covariance_ * across;
    const Eigen::LDLT<Matrix6d> ldlt(schur);
    const Vector6d half = -ldlt.solve(Vector6d(all.gradient.tail<6>()));
    const double explained = half.dot(schur * half);
    if (!half.allFinite() || !ldlt.isPositive() || !(explained > 0)) return std::nullopt;
    // An F test: the noise may have been raised to explain the very drift.
    const double left = equations_.rows - result_.effective_parameters - 6;
    const double f = explained / 6 / (std::max(1e-300, all.squares - explained) / left);
    const boost::math::fisher_f by_chance(6, left);
    if (f < boost::math::quantile(boost::math::complement(by_chance, kByChance))) return std::nullopt;
    return Drift{2 * half, f};
  }

  const PlatformGeometry& drawing_;
  const ObservationSet& observations_;
  const IdentifyOptions& options_;
  MachineModel nominal_;  // the drawing in the frames of the measurement
  IdentifyResult result_;
  LegNoise noise_;
  std::vector<ParameterKind> kinds_;
  Eigen::VectorXd initial_tolerances_;
  Eigen::VectorXd frame_steps_;
  std::vector<Pose> filled_;
  std::vector<LegLinearization> legs_;
  std::vector<ReducedPose> reduced_;
  NormalEquations equations_;
  Eigen::MatrixXd covariance_;
  double rows_ = 0;
  double step_squares_ = kInfinity;
  double hyper_change_ = 0;
  bool adapt_tolerances_ = false;
  bool adapt_noise_ = false;
};

}  // namespace

std::string Drift::sentence() const {
  return fmt::format(
      "the machine moved by {:.2g} mm and {:.2g} deg against the measuring frame from the first pose to "
      "the last",
      motion.head<3>().norm(), motion.tail<3>().norm() * kDegPerRad);
}

IdentifyResult identify(const PlatformGeometry& nominal, const ObservationSet& observations,
                        const IdentifyOptions& options, const IdentifyResult* start) {
  options.validate();
  if (std::string why = unusable(observations); !why.empty()) {
    IdentifyResult refused;
    refused.reason = std::move(why);
    return refused;
  }
  return Identification(nominal, observations, options).run(start);
}

}  // namespace hexcal
