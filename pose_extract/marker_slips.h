#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "photogrammetry/adjustment/adjustment_result.h"

// Did every marker keep its place on its body through the campaign? A sticker that slips, or a grip whose
// parts shift against each other, is seen as a step in time.

namespace hexcal {

/// A marker that stands elsewhere from some epoch on.
struct MarkerSlip {
  int feature = 0;
  std::size_t before = 0;  ///< epochs between which it moved
  std::size_t after = 0;
  double moved_mm = 0;
  double statistic = 0;        ///< the step's chi^2 over its quantile: above 1
  bool after_is_kept = false;  ///< most of its sightings are after the step
  bool many = false;           ///< the last of so many of its body that the others may be those that moved
};

/// The marker with the clearest step, tested over `epochs` in the order in which they were photographed: its
/// places before and after against their noise, and against what they scatter from epoch to epoch. A marker's
/// place in a photograph is measured from the other markers of its body there.
[[nodiscard]] std::optional<MarkerSlip> find_marker_slip(const Network& network,
                                                         const AdjustmentResult& adjusted,
                                                         const std::vector<std::size_t>& epochs);

/// Leaves out the fewer sightings of each marker that slipped (as not measured in `network`) and adjusts
/// again, marker by marker; names them. `adjusted` belongs to the network as it is left.
[[nodiscard]] std::vector<MarkerSlip> leave_out_slipped_markers(
    const std::vector<std::size_t>& epochs, const std::function<AdjustmentResult()>& adjust, Network& network,
    AdjustmentResult& adjusted);

}  // namespace hexcal
