#pragma once

#include <vector>

#include "photogrammetry/adjustment/sighting.h"

namespace hexcal {

/// First geometry of a network from its sightings alone, no user guess: each marker's two planar poses are
/// carried until another marker or photograph decides; photographs and markers are joined one after the
/// other, best connected first, over the largest set connected by shared fixed markers; then the moving body
/// is put together in the same way over the epochs; then photographs that see the moving body only. World and
/// moving frame are those of a marker. What is not connected keeps has_* unset, and its sightings become
/// `unoriented`. With a `map`, the geometry of an earlier adjustment of the same cameras and markers, those
/// are taken from it and photographs and epochs are oriented by them.
[[nodiscard]] NetworkGeometry initial_network(const Network& network, std::vector<Sighting>& sightings,
                                              const NetworkGeometry* map = nullptr);

}  // namespace hexcal
