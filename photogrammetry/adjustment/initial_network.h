#pragma once

#include <vector>

#include "photogrammetry/adjustment/sighting.h"

namespace hexcal {

/// First geometry of a network from its sightings alone, no user guess: each square's two planar poses are
/// carried until another square or photograph decides; stations and squares are joined one after the other,
/// best connected first, over the largest set connected by shared squares of the reference body; then each
/// moving body is put together in the same way over the epochs; then photographs that see moving bodies only;
/// last, single points by intersection. World and body frames are those of a square, unless stations or
/// features are known. What is not connected keeps has_* unset, and its sightings become `unoriented`. With a
/// `map`, the geometry of an earlier adjustment of the same cameras and features, those are taken from it and
/// stations and poses are oriented by them.
[[nodiscard]] NetworkGeometry initial_network(const Network& network, std::vector<Sighting>& sightings,
                                              const NetworkGeometry* map = nullptr);

}  // namespace hexcal
