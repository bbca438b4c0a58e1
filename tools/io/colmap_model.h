#pragma once

#include <string>
#include <utility>
#include <vector>

#include "pose_extract/extract_poses.h"

namespace hexcal {

/// COLMAP's text model (cameras.txt, images.txt, points3D.txt) as (name, contents), for its viewer: stations
/// and marker corners in UG with the observations that carry them; a moving corner is one point per pose. The
/// lens is written as FULL_OPENCV where hexcal's model is one of OpenCV's, else as PINHOLE with the
/// observations freed of the distortion: a picture, not a calibration.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> format_colmap_model(
    const CampaignObservations& observations, const CampaignResult& result);

}  // namespace hexcal
