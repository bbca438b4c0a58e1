#pragma once

#include <string>
#include <vector>

#include "tools/campaign/open_campaign.h"

namespace hexcal {

/// What can be said of a photograph of the listing without decoding it. A photograph without a finding is
/// good.
struct HeadFinding {
  std::size_t image = 0;  ///< index into OpenCampaign::listing.images
  bool bad = false;       ///< it would not be measured; otherwise a remark
  bool foreign = false;   ///< bad because no camera file suits it
  std::string words;
};

struct HeadInspection {
  std::vector<HeadFinding> findings;
  std::vector<int> camera_of_image;  ///< per image of the listing; -1: none is for it, or it cannot be read
};

/// Empty files, files that are no photographs, photographs seen twice, of another camera, size or lens
/// setting.
[[nodiscard]] HeadInspection inspect_heads(const OpenCampaign& open);

/// Throws UnsuitedCamera where no photograph suits a camera, as a measurement would.
void refuse_foreign_camera(const OpenCampaign& open, const HeadInspection& heads);

}  // namespace hexcal
