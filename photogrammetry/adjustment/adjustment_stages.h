#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "photogrammetry/adjustment/adjustment.h"
#include "photogrammetry/adjustment/bundle_solver.h"
#include "photogrammetry/adjustment/outlier_test.h"

// The steps that an adjustment is made of (adjustment.cc, marker_map.cc).

namespace hexcal {

/// What stays the same during one adjustment.
struct AdjustmentJob {
  const Network& network;
  const AdjustmentOptions& options;
};

/// State of an adjustment as it goes through its steps.
struct AdjustmentStage {
  NetworkGeometry geometry;
  std::vector<Sighting> sightings;
  BundleLayout layout;
  BundleSettings settings;
  std::optional<BundleSystem> system;  ///< undamped, at the solution; empty until it is analysed
  Eigen::MatrixXd covariance;          ///< of the common parameters; given where they do not move
  double redundancy = 0;               ///< of the observations alone
  double squares = 0;                  ///< of the observations, over the data variance
  bool converged = false;
  int iterations = 0;
};

void solve(const AdjustmentJob& job, AdjustmentStage& stage);

/// System, covariance and redundancy at the present solution.
void analyse(const AdjustmentJob& job, AdjustmentStage& stage);

/// test_sightings() at the analysed solution.
[[nodiscard]] std::vector<SightingTest> test_stage(const AdjustmentJob& job, const AdjustmentStage& stage);

/// Graduated robust adjustment: the limit follows the median of the sightings' squares until both settle.
/// Returns the square of the last limit.
double solve_robustly(const AdjustmentJob& job, AdjustmentStage& stage);

/// Iterated test of every sighting against the rest, after a robust start.
void reject_outliers(const AdjustmentJob& job, AdjustmentStage& stage, double robust_limit2);

/// Drops photographs, poses and features that no used sighting supports any more.
void drop_unsupported(const AdjustmentJob& job, AdjustmentStage& stage);

}  // namespace hexcal
