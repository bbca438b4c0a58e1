#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "calibration/observation.h"

namespace hexcal {

/// The same campaign as it would read without one slip.
struct ReadOtherwise {
  PlatformGeometry nominal{};
  ObservationSet observations;
};

/// One slip that people make with the conventions of poses, legs or drawings.
struct SuspectConvention {
  std::string slip;         ///< what would be wrong, as a clause: "the measured angles are in radians"
  std::string instruction;  ///< what to do about it, in the imperative
  /// The campaign without the slip; nothing where it does not apply (too few poses, not the same machine).
  std::function<std::optional<ReadOtherwise>(const PlatformGeometry&, const ObservationSet&)> undo;
  /// Changes nothing but the frames of the measurement, so it is pointless where those are unknown.
  bool is_frame = false;
};

/// The usual slips, likely ones first: units of lengths and angles, signs, the 47 other ways to name the axes
/// of a right- or left-handed frame, inverse poses, rotation vectors, the other orders of Euler angles,
/// shifted or reversed pose names, numbering, zero and direction of the legs, exchanged drawings. They work
/// on complete poses (all six coordinates measured); others are left out of what they return.
[[nodiscard]] const std::vector<SuspectConvention>& suspect_conventions();

}  // namespace hexcal
