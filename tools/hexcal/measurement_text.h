#pragma once

#include <string>

#include "tools/campaign/measure_campaign.h"

namespace hexcal {

/// A measurement in lines for people: poses, photographs that need a look, lengths, warnings, a summary.
[[nodiscard]] std::string measurement_text(const CampaignMeasurement& measurement);

/// kDone, or kSomeFailed when a pose or photograph is not ok.
[[nodiscard]] int measurement_exit_code(const CampaignResult& result);

}  // namespace hexcal
