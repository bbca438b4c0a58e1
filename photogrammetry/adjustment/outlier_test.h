#pragma once

#include <vector>

#include "photogrammetry/adjustment/bundle_system.h"

namespace hexcal {

struct SightingTest {
  /// Squared misfit over its covariance: for a used sighting how much its presence raises the sum of squares
  /// (chi^2 with `rows` degrees of freedom), for one left out how far it lies from its prediction.
  double statistic = 0;
  double redundancy = 0;  ///< mean redundancy number of its rows
};

/// Tests each sighting whose photograph, pose and feature are known, used or left out. `system` is undamped
/// and `covariance` that of the common parameters.
[[nodiscard]] std::vector<SightingTest> test_sightings(
    const Network& network, const NetworkGeometry& geometry, const std::vector<Sighting>& sightings,
    const BundleLayout& layout, const BundleSettings& settings, const BundleSystem& system,
    const Eigen::MatrixXd& covariance);

}  // namespace hexcal
