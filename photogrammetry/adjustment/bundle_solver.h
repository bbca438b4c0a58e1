#pragma once

#include <optional>
#include <vector>

#include "photogrammetry/adjustment/bundle_system.h"

namespace hexcal {

struct BundleSolution {
  NetworkGeometry geometry;
  bool converged = false;
  int iterations = 0;
  std::vector<double> squares;  ///< per sighting: sum of squares of its whitened residuals; -1 if not used
  /// Undamped, before the last step, which was too small to matter; empty where there is none such.
  std::optional<BundleSystem> system;
};

/// Levenberg-Marquardt to the minimum of the sum of squares, or with `robust_limit` c > 0 of the redescending
/// c^2 q / (c^2 + q) of each sighting's sum of squares q (Geman and McClure, 1987).
[[nodiscard]] BundleSolution solve_bundle_adjustment(const Network& network, const NetworkGeometry& start,
                                                     const std::vector<Sighting>& sightings,
                                                     const BundleLayout& layout,
                                                     const BundleSettings& settings, double robust_limit,
                                                     int max_iterations);

}  // namespace hexcal
