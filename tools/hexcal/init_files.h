#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tools/io/campaign_text.h"

// Files of a new campaign beside campaign.yaml, as `hexcal init` writes them.

namespace hexcal {

/// The table of (file, pose) that campaign.yaml names as images_table.
[[nodiscard]] std::string images_table_text(const std::string& head,
                                            const std::vector<std::pair<std::string, std::string>>& table);

/// A targets.csv to be filled in: home is zero, every other pose a row without numbers.
[[nodiscard]] std::string targets_template(const std::string& head, const std::vector<std::string>& poses,
                                           const std::string& home);

/// Names and contents of what to print before the first photograph: stickers for the grips and a sheet on A3
/// for the camera, whose ids are none of the stickers'.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> prints_for_new_campaign(
    const CampaignDraft& draft, double marker_mm);

}  // namespace hexcal
