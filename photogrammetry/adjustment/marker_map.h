#pragma once

#include <vector>

#include "photogrammetry/adjustment/adjustment.h"

namespace hexcal {

/// adjust_network() in two steps, for campaigns of so many poses that one adjustment takes too long: first
/// the epochs of `map_epochs` alone, which gives interior orientation, features and their covariance (the
/// map); then every other epoch by itself on that map, which it does not change. The map's covariance goes
/// into those of all epochs, so that the sigmas state what is lost against one
/// adjustment. Features that no epoch of the map shows are `unoriented`.
[[nodiscard]] AdjustmentResult adjust_network_by_map(const Network& network,
                                                     const std::vector<int>& map_epochs,
                                                     const AdjustmentOptions& options);

}  // namespace hexcal
