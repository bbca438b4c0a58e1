#pragma once

#include <string>
#include <utility>
#include <vector>

#include "pose_extract/extract_poses.h"

namespace hexcal {

/// COLMAP's text model (cameras.txt, images.txt, points3D.txt) as (name, contents), for its viewer: stations
/// and markers in the fixed body's frame, moving markers where they stood at the first measured pose. The
/// lens is written as FULL_OPENCV where hexcal's model is one of OpenCV's, else as PINHOLE: a picture, not a
/// calibration.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> format_colmap_model(
    const CampaignObservations& observations, const CampaignResult& result);

}  // namespace hexcal
