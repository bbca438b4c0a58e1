#pragma once

#include <string>

#include "pose_extract/extract_poses.h"

namespace hexcal {

/// The measured markers as squares (PLY, ASCII): fixed ones in UG, moving ones as they stand at home (LG at
/// Trans(0, 0, -gd)), camera stations as points. Coordinates in mm.
[[nodiscard]] std::string format_markers_ply(const std::string& head, const CampaignResult& result);

/// The corners as a point cloud (PCD 0.7, ASCII) with the marker's id as label.
[[nodiscard]] std::string format_markers_pcd(const std::string& head, const CampaignResult& result);

}  // namespace hexcal
