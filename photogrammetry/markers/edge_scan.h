#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "photogrammetry/markers/blurred_pattern.h"
#include "photogrammetry/photograph/tone_response.h"

namespace hexcal {

/// Moves the corners of a marker's square from within about 3 px to within about 0.3 px: looks along the
/// normals of its four sides for the places half way between black and white in linear light, fits a line to
/// each side robustly and intersects them. None where too few places are found on a side.
[[nodiscard]] std::optional<std::array<Eigen::Vector2d, 4>> scan_edges(
    const cv::Mat& grey, const ToneResponse& tone, const BlurredPattern& pattern, double square_cells,
    const std::array<Eigen::Vector2d, 4>& corners_px);

}  // namespace hexcal
