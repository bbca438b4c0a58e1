#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tools/campaign/open_campaign.h"

namespace hexcal {

/// What a finished measurement said and wrote.
struct MeasurementAnswer {
  std::string text;  ///< for people; for machines it is quality.json
  std::vector<std::filesystem::path> written;
  int exit_code = 0;
};

/// The answer of the last measurement of a campaign if a new one could give no other: the same program and
/// flags, the same listing, and every file that was read or written still has the content it had then
/// (SHA-256 of all of them, photographs included). Nothing otherwise.
[[nodiscard]] std::optional<MeasurementAnswer> unchanged_measurement(const MeasureRequest& request,
                                                                     const OpenCampaign& open);

/// Keeps an answer for unchanged_measurement, in the cache of the results, unless a file that was read has
/// been written since the campaign was opened.
void keep_measurement(const MeasureRequest& request, const OpenCampaign& open,
                      const CampaignObservations& observations, const MeasurementAnswer& answer);

}  // namespace hexcal
