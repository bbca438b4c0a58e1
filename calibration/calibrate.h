#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/identifiability.h"
#include "calibration/machine_doubt.h"
#include "calibration/method_comparison.h"

namespace hexcal {

struct CalibrateOptions {
  /// "auto", "option1", "option2", "option3", "kinematic" (extensions by cross-validation), "geometry"
  /// (without them) or the exact name of a candidate.
  std::string method = "auto";
  IdentifyOptions identify;
  ComparisonOptions comparison;
};

/// The paper's evaluation of one option for the user's campaign (tables 2 to 4, figures 11 to 16). "After" is
/// what cross-validation expects to remain; measured poses after compensation are evaluated by
/// error_statistics.
struct PaperEvaluation {
  std::string method;
  std::vector<std::string> valid;       ///< pose ids whose corrected command is in the workspace
  std::vector<std::string> dropped;     ///< and those that fall out of it
  ErrorStatistics before;               ///< over `valid`, as the paper should have done
  ErrorStatistics after;                ///< over `valid`
  ErrorStatistics after_common;         ///< over CalibrationReport::common
  std::vector<Vector6d> errors_before;  ///< of `valid`: figures 12, 14, 16
  std::vector<Vector6d> errors_after;
};

struct CalibrationReport {
  std::vector<std::string> outliers;     ///< the paper's near-singular rule: out for all methods
  std::vector<std::string> unexplained;  ///< poses that fit no method: out of the comparison
  std::vector<std::string> pose_ids;     ///< poses with a target, outliers included
  std::vector<Vector6d> errors;          ///< measured minus target: figure 9
  /// Over the poses that methods are compared on, so without `outliers` and `unexplained`: figure 10; nothing
  /// without targets.
  std::optional<ErrorStatistics> uncompensated;
  /// Poses that every method keeps in the workspace: the set over which rows of one table can be compared.
  std::vector<std::string> common;
  ErrorStatistics common_before;
  MethodComparison comparison;               ///< its indices are of the observations given to calibrate
  std::vector<PaperEvaluation> evaluations;  ///< in the order of comparison.methods; empty without targets
  std::string chosen;                        ///< name of the candidate
  std::string why;
  FittedMethod fitted;                             ///< the chosen method, fitted to all poses but outliers
  std::vector<std::string> fitted_ids;             ///< in the order of fitted.identified's residuals
  std::optional<Identifiability> identifiability;  ///< when that is kinematic
  /// Where set, poses and hexapod.yaml do not speak of one machine: nothing here is to be sent to it, and
  /// fitted.model is the nominal machine.
  std::optional<MachineDoubt> doubt;
};

/// From observations to a model: outliers out, all methods side by side by cross-validation, the wanted or
/// the best one fitted to everything. Throws InputError when the poses cannot carry any model (fewer than 4,
/// all at one place, all level) or the wanted one.
[[nodiscard]] CalibrationReport calibrate(const PlatformGeometry& nominal, const ObservationSet& observations,
                                          const CalibrateOptions& options = {});

/// The chosen method's commands for the targets; where the report doubts the machine, every one is `withheld`
/// and has no numbers.
[[nodiscard]] std::vector<CorrectedCommand> corrected_commands(const CalibrationReport& report,
                                                               const std::vector<Target>& targets,
                                                               const LegVector& approach = LegVector::Zero());

}  // namespace hexcal
