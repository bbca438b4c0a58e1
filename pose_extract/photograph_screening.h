#pragma once

#include <vector>

#include "pose_extract/extract_poses.h"

namespace hexcal {

/// Sets aside, with words, photographs that cannot count whatever they show: unreadable ones, those of
/// another camera, lens setting or size, the same file twice. The home pose has the first claim on a
/// photograph.
[[nodiscard]] std::vector<MeasuredPhotograph> screen_photographs(const Campaign& campaign,
                                                                 const CampaignObservations& observations);

}  // namespace hexcal
