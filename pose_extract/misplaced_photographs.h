#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "pose_extract/extract_poses.h"

namespace hexcal {

/// A photograph in which one body fits the campaign and the other does not.
struct MisplacedPhotograph {
  std::size_t photo = 0;             ///< index into Network::photos
  std::optional<std::size_t> epoch;  ///< where the other body fits; none: nowhere
};

/// Photographs of which all markers of one body (at least two) were rejected while those of the other fit. Of
/// the other epochs the one is named at which the rejected markers project onto their images several times
/// better than at any other.
[[nodiscard]] std::vector<MisplacedPhotograph> misplaced_photographs(const CampaignResult& result);

}  // namespace hexcal
