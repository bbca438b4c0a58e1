#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/compensation.h"
#include "calibration/statistics.h"

namespace hexcal {

/// A way to compensate that can be fitted to a set of observations.
struct Candidate {
  std::string name;  ///< "option3", "kinematic", "kinematic + curves", ...
  CompensationMethod method = CompensationMethod::nominal;
  IdentifyOptions identify;  ///< of kinematic
  int complexity = 0;        ///< how many numbers it has: the order of simplicity
};

/// The paper's options (where most poses are complete) and the kinematic models that the data can bear.
/// Kinematic models: leg offsets only, with scales, with joints, with curves along the stroke, with sag, and
/// with backlash where approach directions are known.
[[nodiscard]] std::vector<Candidate> candidates_for(const ObservationSet& observations,
                                                    const IdentifyOptions& base);

struct FittedMethod {
  CalibrationModel model;
  std::optional<IdentifyResult> identified;
};

/// Nothing when the method cannot be fitted to these observations; `reason` then says why. `start`: as for
/// identify.
[[nodiscard]] std::optional<FittedMethod> fit_candidate(const PlatformGeometry& nominal,
                                                        const ObservationSet& observations,
                                                        const Candidate& candidate, std::string* reason,
                                                        const IdentifyResult* start = nullptr);

/// Predicted error over all six coordinates, rms, where not all of them were measured.
struct PredictedOverAll {
  double position_mm = 0;
  double orientation_rad = 0;
};

/// How well one candidate compensates poses that it has not seen.
struct CrossValidation {
  std::string name;
  CompensationMethod method = CompensationMethod::nominal;
  int complexity = 0;
  std::string failure;     ///< why there is no result; else empty
  int poses = 0;           ///< held out, each once
  ErrorStatistics errors;  ///< that would remain after compensation, with the measurement's noise in them
  double position_rms_se_mm = 0;  ///< standard errors of the rms values
  double orientation_rms_se_rad = 0;
  std::optional<PredictedOverAll> predicted;  ///< see unmeasured.h
  int targets_lost = 0;                       ///< targets whose corrected command breaks a limit
  /// Squared error of each pose, mm^2, rotations as arcs at the characteristic length; in pose order.
  std::vector<double> losses_mm2;
  /// What each may be by the measurement's noise and, of kinematic, by what the fit knows of the parameters;
  /// in the order of held_out.
  std::vector<double> expected_mm2;
  std::vector<double> weights;            ///< of the losses in every comparison of methods; their mean is 1
  std::vector<std::size_t> without_pose;  ///< held-out observations at whose readings no pose was found
  std::vector<PosePair> held_out;         ///< target: modelled, actual: measured
  std::vector<std::size_t> held_out_index;
  double mean_loss_mm2() const;  ///< weighted
};

/// Weighted losses of a minus those of b, pose by pose.
[[nodiscard]] std::vector<double> loss_differences(const CrossValidation& a, const CrossValidation& b);

struct ComparisonOptions {
  int leave_one_out_up_to = 40;  ///< poses; more are held out in folds
  int folds = 10;
};

struct MethodComparison {
  bool leave_one_out = false;
  int folds = 0;
  /// Observations that no method explains, at most a fifth: measured wrongly. They take part in no statistic
  /// and no choice.
  std::vector<std::size_t> unexplained;
  std::vector<CrossValidation> methods;
  std::vector<std::optional<FittedMethod>> fitted;  ///< the same candidates, fitted to all poses
  std::size_t best = 0;                             ///< least loss
  std::size_t chosen = 0;                           ///< the simplest within one standard error of the best
  std::string why;                                  ///< one line
};

/// Cross-validates all candidates over the same folds; poses of nearly the same readings are in one fold. The
/// error that would remain at a held-out pose is the
/// difference between the pose that the fitted model expects at the readings used and the pose measured: with
/// the measured pose as a target, the model would have been wrong by that. The choice compares losses
/// pairwise over poses (one-standard-error rule of Breiman et al. 1984 on the differences), where sigmas were
/// measured with weights: a pose that was measured badly says little.
[[nodiscard]] MethodComparison compare_methods(const PlatformGeometry& nominal,
                                               const ObservationSet& observations,
                                               const std::vector<Candidate>& candidates,
                                               const ComparisonOptions& options = {});

/// Observations of unknown frames as the hexapod's own frames see them: where the nominal machine fits them
/// best. Coordinates that were not measured take the value that this machine has. Throws InputError where the
/// frames cannot be found.
[[nodiscard]] ObservationSet in_hexapod_frames(const PlatformGeometry& nominal,
                                               const ObservationSet& observations);

}  // namespace hexcal
