#include "calibration/machine_doubt.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "calibration/free_parameters.h"
#include "calibration/suspect_conventions.h"
#include "kinematics/dh_chain.h"
#include "kinematics/forward.h"

namespace hexcal {
namespace {

// Shares of the rms distance between the targets and their mean (rotations as arcs at the characteristic
// length) beyond which an error, or what the best model leaves, is no bad machine. Machines as bad as the
// paper's, whose errors are a third of its targets, reach 0.55 in five poses; a unit or exchanged axes give 1
// and more. A single sign may give less: it is found among the usual slips.
constexpr double kAbsurdError = 0.8;
constexpr double kAbsurdRemainder = 0.25;
constexpr int kFewestForRemainder = 8;
// Limits of the misfit (misfit_of). Slips of axes, units, signs and names give 200 and more, the paper's
// machine up to 6. A slip that explains one must leave less than kPlausibleMisfit and less than the
// given share of it; below the last, there is no contradiction, whatever would make it smaller.
constexpr double kAbsurdMisfit = 100;
constexpr double kPlausibleMisfit = 8;
constexpr double kCollapse = 1.0 / 9;
constexpr double kHarmlessMisfit = 0.2;
// Residuals this many times their sigmas are worth the search for a slip.
constexpr double kNotableSigma0 = 4;
constexpr std::size_t kFewestPoses = 6;
// As many slips are fitted, those first that leave the least before a fit.
constexpr std::ptrdiff_t kTriedSlips = 48;
// Two slips that explain as much as each other to this factor cannot be told apart.
constexpr double kAlike = 1.5;
// Unit of the legs' residuals in a misfit.
constexpr double kLegSigmaMm = 0.3;
// The paper's machine is off by up to 25 deg at home, in yaw.
constexpr double kLargestHomeErrorRad = 40 * kRadPerDeg;

// The rms distance of the targets from their mean, mm.
double spread_of(const ObservationSet& observations, double length_mm) {
  std::vector<Vector6d> targets;
  Vector6d mean = Vector6d::Zero();
  for (const PoseObservation& pose : observations.poses) {
    if (!pose.target || pose.is_definition) continue;
    targets.push_back(pose.target->vector());
    mean += targets.back();
  }
  if (targets.empty()) return 0;
  mean /= static_cast<double>(targets.size());
  double squares = 0;
  for (const Vector6d& target : targets) squares += squares_mm2(target - mean, length_mm);
  return std::sqrt(squares / static_cast<double>(targets.size()));
}

// The same of what the machine did wrong, its common part included. Only of coordinates that were measured.
double error_of(const ObservationSet& seen, const std::vector<std::string>& left_out, double length_mm) {
  double squares = 0;
  double count = 0;
  for (const PoseObservation& pose : seen.poses) {
    if (!pose.target || pose.is_definition) continue;
    if (std::ranges::find(left_out, pose.id) != left_out.end()) continue;
    Vector6d error = pose_error(pose.measured, *pose.target);
    for (std::size_t k = 0; k < 6; ++k)
      if (!pose.observed[k]) error[static_cast<Eigen::Index>(k)] = 0;
    squares += squares_mm2(error, length_mm);
    count += 1;
  }
  return count > 0 ? std::sqrt(squares / count) : 0;
}

// How far the poses and the drawing are from each other.
struct Misfit {
  /// Mean square of what the legs leave, in units of 0.3 mm, and of the corrections, in units of their
  /// tolerances. About 0 to 5 for machines of the usual make, hundreds where a convention is wrong. Unlike
  /// sigma0 it does not depend on how well the poses were measured.
  double mean_square = 0;
  double joint_mm = 0;  ///< largest correction of a joint coordinate
};

// Which frames of the measurement are the hexapod's.
enum class Frames { known, home_unknown, unknown };

IdentifyOptions misfit_options(Frames frames) {
  IdentifyOptions options;
  options.frames_unknown = frames != Frames::known;
  if (frames == Frames::home_unknown)
    for (int i = 0; i < 6; ++i)
      options.fixed.insert(parameter_name(ParameterLayout{}, ParameterLayout::kBaseFrame + i));
  options.adapt_tolerances = false;
  options.estimate_leg_sigma = false;
  options.leg_sigma_mm = kLegSigmaMm;
  options.robust = false;  // a slip is in all poses
  options.max_iterations = 40;
  return options;
}

// LG on the platform where the nominal machine's legs see it at the measured poses.
std::optional<Rigid3> seen_P_from_LG(const PlatformGeometry& nominal, const ObservationSet& observations) {
  std::vector<Rigid3> seen;
  for (const PoseObservation& pose : observations.poses) {
    const ForwardResult solved = forward_kinematics(nominal, lengths_from_readings(nominal, pose.readings));
    if (solved.status != ForwardStatus::converged) continue;
    seen.push_back(inverse(*solved.B_from_P) * nominal.B_from_UG * ug_from_lg(pose.measured, nominal.gd_mm));
  }
  if (seen.empty()) return std::nullopt;
  return mean_motion(seen);
}

std::optional<Misfit> misfit_of(const PlatformGeometry& nominal, const ObservationSet& observations,
                                Frames frames) {
  if (observations.poses.size() < kFewestPoses) return std::nullopt;
  const IdentifyOptions options = misfit_options(frames);
  ObservationSet set = observations;
  set.covariance_known = true;
  set.joint_covariance.resize(0, 0);
  for (PoseObservation& pose : set.poses) pose.covariance = Matrix6d::Identity() * 1e-12;
  std::optional<IdentifyResult> start;
  if (frames == Frames::home_unknown) {
    const auto P_from_LG = seen_P_from_LG(nominal, set);
    if (!P_from_LG) return std::nullopt;
    const FreeParameters free = free_parameters(options);
    start.emplace();
    start->corrections.setZero(free.layout.size());
    start->tolerances = free.tolerances;
    start->leg_sigma_mm = kLegSigmaMm;
    start->machine.geometry = nominal;
    start->machine.geometry.P_from_LG = *P_from_LG;
  }
  const IdentifyResult fit = identify(nominal, set, options, start ? &*start : nullptr);
  if (fit.status != IdentifyStatus::identified) return std::nullopt;
  if (frames == Frames::home_unknown) {
    const Rigid3 moved = inverse(nominal.P_from_LG) * fit.machine.geometry.P_from_LG;
    if (Eigen::AngleAxisd(moved.rotation_matrix()).angle() > kLargestHomeErrorRad) return std::nullopt;
  }
  Misfit out;
  for (const LegVector& residuals : fit.leg_residuals_mm)
    out.mean_square += residuals.squaredNorm() / (kLegSigmaMm * kLegSigmaMm);
  for (int i = 0; i < fit.layout.size(); ++i) {
    const int free = fit.selection.free_of[static_cast<std::size_t>(i)];
    if (free < 0 || !std::isfinite(fit.tolerances[free])) continue;
    const double correction = std::abs(fit.corrections[i]);
    out.mean_square += std::pow(correction / fit.tolerances[free], 2);
    if (parameter_kind(fit.layout, i) == ParameterKind::joint)
      out.joint_mm = std::max(out.joint_mm, correction);
  }
  out.mean_square /= 6.0 * static_cast<double>(fit.leg_residuals_mm.size());
  return out;
}

// As given; or, where that is less, with LG where the machine's own error at home puts it. Where home defines
// LG that is no slip.
std::optional<Misfit> plain_misfit(const PlatformGeometry& nominal, const ObservationSet& observations,
                                   bool frames_unknown) {
  auto misfit = misfit_of(nominal, observations, frames_unknown ? Frames::unknown : Frames::known);
  if (frames_unknown) return misfit;
  const auto own = misfit_of(nominal, observations, Frames::home_unknown);
  if (own && (!misfit || own->mean_square < misfit->mean_square)) misfit = own;
  return misfit;
}

struct Explanation {
  std::string slip;
  std::string instruction;
  double misfit = 0;
};

// The complete ones of these poses that some method explains.
ObservationSet poses_to_fit(const ObservationSet& observations, const std::vector<std::string>& unexplained) {
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < observations.poses.size(); ++i) {
    const PoseObservation& pose = observations.poses[i];
    const bool bad = std::ranges::find(unexplained, pose.id) != unexplained.end();
    if (pose.complete() && !bad) kept.push_back(i);
  }
  return observations.subset(kept);
}

// Rms of what the drawing's legs leave at the poses before anything is fitted, mm; LG as drawn or as seen.
double unfitted_mm(const ReadOtherwise& campaign) {
  double least = std::numeric_limits<double>::infinity();
  PlatformGeometry geometry = campaign.nominal;
  for (const bool seen : {false, true}) {
    if (seen) {
      const auto P_from_LG = seen_P_from_LG(campaign.nominal, campaign.observations);
      if (!P_from_LG) break;
      geometry.P_from_LG = *P_from_LG;
    }
    double squares = 0;
    for (const PoseObservation& pose : campaign.observations.poses) {
      squares += (leg_lengths(geometry, geometry.B_from_P(pose.measured)) -
                  lengths_from_readings(geometry, pose.readings))
                     .squaredNorm();
    }
    least = std::min(least, std::sqrt(squares / static_cast<double>(campaign.observations.poses.size())));
  }
  return least;
}

// The slip without which most of the misfit is gone.
std::optional<Explanation> find_slip(const DoubtRequest& request, bool frames_unknown, double limit) {
  struct Tried {
    const SuspectConvention* suspect;
    ReadOtherwise campaign;
    double unfitted_mm;
    std::optional<Misfit> misfit;
  };
  std::vector<Tried> tried;
  for (const SuspectConvention& suspect : suspect_conventions()) {
    if (frames_unknown && suspect.is_frame) continue;
    auto other = suspect.undo(*request.nominal, *request.observations);
    if (!other) continue;
    // Left out afterwards: a slip of names counts all poses.
    other->observations = poses_to_fit(other->observations, *request.unexplained);
    if (other->observations.poses.size() < kFewestPoses) continue;
    const double unfitted = frames_unknown ? 0 : unfitted_mm(*other);
    tried.push_back({&suspect, std::move(*other), unfitted, std::nullopt});
  }
  // The right one is among those that the drawing fits best as it is.
  std::ranges::stable_sort(tried, {}, &Tried::unfitted_mm);
  if (!frames_unknown && std::ssize(tried) > kTriedSlips)
    tried.erase(tried.begin() + kTriedSlips, tried.end());
  tbb::parallel_for(std::size_t{0}, tried.size(), [&](std::size_t i) {
    tried[i].misfit = plain_misfit(tried[i].campaign.nominal, tried[i].campaign.observations, frames_unknown);
  });
  std::erase_if(tried, [&](const Tried& one) { return !one.misfit || one.misfit->mean_square > limit; });
  if (tried.empty()) return std::nullopt;
  double least = limit;
  for (const Tried& one : tried) least = std::min(least, one.misfit->mean_square);
  std::erase_if(tried, [&](const Tried& one) { return one.misfit->mean_square > kAlike * least + 1e-3; });
  // Likely ones first, as they are listed.
  std::ranges::sort(tried, {}, &Tried::suspect);
  Explanation best{tried[0].suspect->slip, tried[0].suspect->instruction, tried[0].misfit->mean_square};
  if (tried.size() > 1) best.slip += fmt::format(" (or {})", tried[1].suspect->slip);
  return best;
}

std::optional<Explanation> explain(const DoubtRequest& request, const ObservationSet& poses, double misfit) {
  const double limit = std::min(kCollapse * misfit, kPlausibleMisfit);
  if (auto slip = find_slip(request, request.frames_unknown, limit)) return slip;
  if (request.frames_unknown) return std::nullopt;
  const auto in_other_frames = misfit_of(*request.nominal, poses, Frames::unknown);
  if (in_other_frames && in_other_frames->mean_square < limit) {
    return Explanation{
        "the poses were measured in other frames than hexapod.yaml's (UG or LG stands elsewhere, "
        "home is not level or its gd is another)",
        "correct the frames, or `--frames unknown`", in_other_frames->mean_square};
  }
  auto slip = find_slip(request, true, limit);
  if (slip) {
    slip->slip += ", and the frames are not hexapod.yaml's";
    slip->instruction += ", and `--frames unknown`";
  }
  return slip;
}

// What contradicts beyond reason, in words; empty where nothing does.
std::string absurdity(const DoubtRequest& request, const std::optional<Misfit>& misfit, double length_mm) {
  const MethodComparison& comparison = *request.comparison;
  const double spread_mm = spread_of(*request.seen, length_mm);
  if (spread_mm > 0) {
    const double error_mm = error_of(*request.seen, *request.unexplained, length_mm);
    if (error_mm > kAbsurdError * spread_mm) {
      return fmt::format(
          "the measured poses are {:.3g} mm rms from their targets (angles as arcs at {:.0f} "
          "mm), where the targets lie only {:.3g} mm rms apart",
          error_mm, length_mm, spread_mm);
    }
    const CrossValidation& best = comparison.methods[comparison.best];
    const double remains_mm = std::sqrt(best.mean_loss_mm2());
    // A handful of poses tells no model from another.
    if (best.poses >= kFewestForRemainder && remains_mm > kAbsurdRemainder * spread_mm) {
      return fmt::format(
          "no model of this machine explains the measured poses: {:.3g} mm rms remain (angles "
          "as arcs at {:.0f} mm), where the targets lie {:.3g} mm rms apart",
          remains_mm, length_mm, spread_mm);
    }
  }
  if (misfit && misfit->mean_square > kAbsurdMisfit) {
    return fmt::format(
        "the measured poses do not fit hexapod.yaml: joints would stand {:.3g} mm from where it "
        "draws them",
        misfit->joint_mm);
  }
  return "";
}

// Whether a slip is worth looking for: a misfit of no usual machine, or residuals far beyond their sigmas.
bool notable(const DoubtRequest& request, double misfit) {
  if (misfit < kHarmlessMisfit) return false;
  if (misfit > kPlausibleMisfit) return true;
  for (const auto& fitted : request.comparison->fitted) {
    if (!fitted || !fitted->identified) continue;
    if (fitted->identified->layout.curve_terms == 0 &&
        fitted->identified->sigma0_of_measurement > kNotableSigma0)
      return true;
  }
  return false;
}

}  // namespace

std::optional<MachineDoubt> doubt_machine(const DoubtRequest& request) {
  const double length_mm = characteristic_length_mm(*request.nominal);
  const ObservationSet poses = poses_to_fit(*request.observations, *request.unexplained);
  const auto misfit = plain_misfit(*request.nominal, poses, request.frames_unknown);
  const std::string absurd = absurdity(request, misfit, length_mm);
  if (absurd.empty() && (!misfit || !notable(request, misfit->mean_square))) return std::nullopt;
  std::optional<Explanation> slip;
  // A fit that does not converge is as bad as any.
  if (poses.poses.size() >= kFewestPoses)
    slip = explain(request, poses, misfit ? misfit->mean_square : kPlausibleMisfit / kCollapse);
  if (absurd.empty() && !slip) return std::nullopt;
  MachineDoubt doubt;
  doubt.evidence = !absurd.empty() ? absurd : "the measured poses fit hexapod.yaml badly";
  if (slip) {
    doubt.slip = slip->slip;
    doubt.instruction = slip->instruction;
  } else {
    doubt.instruction =
        "check hexapod.yaml (units, order and numbering of the joints, zero of the readings), the frames of "
        "the measured poses and the names of the folders; where the frames differ, `--frames unknown`";
  }
  return doubt;
}

}  // namespace hexcal
