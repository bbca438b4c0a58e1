#pragma once

#include <optional>

#include "pose_extract/campaign.h"
#include "pose_extract/target_alignment.h"

namespace hexcal {

/// Measures a campaign whose UG is from its markers (photographs that were measured before are taken from the
/// cache) and fits its poses to its targets. Nothing if the campaign is none such, names no targets, or they
/// do not tell. Throws InputError for what is wrong in the files.
[[nodiscard]] std::optional<TargetAlignment> align_campaign(const Campaign& campaign);

}  // namespace hexcal
