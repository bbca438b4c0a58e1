#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "calibration/identify.h"

namespace hexcal {

enum class PlanCriterion {
  d_optimal,  ///< least volume of the parameters' confidence ellipsoid
  i_optimal,  ///< least mean variance of the pose over the load paths
};

struct PlanOptions {
  std::size_t count = 12;
  PlanCriterion criterion = PlanCriterion::i_optimal;
  IdentifyOptions identify;  ///< which parameters will be identified, with which tolerances
  double position_sigma_mm = 0.05;
  double orientation_sigma_deg = 0.02;
  int max_exchanges = 200;

  /// Throws InputError naming the field.
  void validate() const;
};

/// Predicted error of a pose in the workspace after identification, rms over the evaluated poses.
struct PredictedError {
  std::size_t poses = 0;  ///< number of measured poses
  double position_mm = 0;
  double orientation_rad = 0;
};

struct PosePlan {
  std::vector<std::size_t> chosen;              ///< indices of the candidates, in order of choice
  std::vector<PredictedError> by_count;         ///< of the first n chosen poses after exchange, for growing n
  std::vector<PredictedError> random_by_count;  ///< the same for candidates as they come, for comparison
  int exchanges = 0;
};

/// Poses to choose from: ends of random ways from home, most of the way to the limits of strokes, joints and
/// singularity. Far poses say most about a machine: 12 chosen of them do what 34 random ones of a smaller
/// working range do. Only poses whose tilt is at most `max_tilt_rad`.
[[nodiscard]] std::vector<Pose> planning_candidates(const PlatformGeometry& nominal, std::size_t count,
                                                    std::uint64_t seed, double max_tilt_rad = 4);

/// Chooses poses to measure from candidates: greedy choice, then exchange of single poses while the criterion
/// improves (Fedorov 1972; DETMAX of Mitchell, Technometrics 16 (1974) 203). The tolerances count as prior
/// information, so that every number of poses has a finite prediction. `load_paths`: poses at which the error
/// matters (i_optimal, and the predictions); empty means the candidates.
[[nodiscard]] PosePlan plan_poses(const PlatformGeometry& nominal, const std::vector<Pose>& candidates,
                                  const std::vector<Pose>& load_paths, const PlanOptions& options = {});

}  // namespace hexcal
