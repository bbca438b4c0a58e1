#pragma once

#include <map>
#include <string>
#include <vector>

#include "pose_extract/campaign.h"
#include "tools/report/campaign_report.h"

namespace hexcal {

/// Reads back what `measure` found out about the photographs of a campaign, from its results folder:
/// stations, markers, residuals, quality. `covariances` are those of the poses (x, y, z, roll, pitch, yaw; mm
/// and rad) where they are known; `machine` may be null. Photographs carry no thumbnail yet. Throws
/// InputError where a file is missing or damaged.
[[nodiscard]] NetworkPart read_network_part(const Campaign& campaign, const CampaignReport& report,
                                            const std::map<std::string, Matrix6d>& covariances,
                                            const PlatformGeometry* machine);

/// Gives every photograph that can still be read a small grey JPEG, smaller the more there are, so that all
/// together stay near 3 MB.
void add_thumbnails(const std::filesystem::path& images, NetworkPart& network);

}  // namespace hexcal
