#pragma once

#include <string>
#include <vector>

#include "tools/hexcal/campaign_measurement.h"

namespace hexcal {

/// What can be said of a photograph of the listing without decoding it.
struct HeadFinding {
  std::size_t image = 0;  ///< index into OpenCampaign::listing.images
  bool bad = false;       ///< it would not be measured; otherwise a remark
  std::string words;
};

/// Empty files, files that are no photographs, photographs seen twice, of another camera, size or lens
/// setting.
[[nodiscard]] std::vector<HeadFinding> inspect_heads(const OpenCampaign& open);

}  // namespace hexcal
