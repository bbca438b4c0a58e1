#pragma once

#include <filesystem>
#include <optional>

#include "tools/campaign/open_campaign.h"

namespace hexcal {

/// Writes results/overlays/POSE_NAME.jpg: the photograph with its markers (green used, red left out, grey not
/// measured), ids and residual vectors 200 times as long as they are. Nothing for a photograph that cannot be
/// read.
std::optional<std::filesystem::path> write_overlay(const OpenCampaign& open,
                                                   const CampaignObservations& observations,
                                                   const CampaignResult& result, std::size_t photograph);

}  // namespace hexcal
