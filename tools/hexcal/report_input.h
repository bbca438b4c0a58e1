#pragma once

#include <filesystem>
#include <string>

#include "tools/report/campaign_report.h"

namespace hexcal {

/// Everything that the files of a measured campaign say, for its page; parts that are missing say so. The
/// machine is identified by `method` as `hexcal compensate` does, unless results/calibration.json holds that
/// already. Throws InputError for what is wrong in the campaign's own files.
[[nodiscard]] CampaignReport read_campaign_report(const std::filesystem::path& campaign,
                                                  const std::string& method);

/// The folder of a campaign given by itself or by its campaign.yaml.
[[nodiscard]] std::filesystem::path campaign_folder(const std::filesystem::path& campaign);

}  // namespace hexcal
