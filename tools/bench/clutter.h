#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>

namespace hexcal {

constexpr int kClutterWidthPx = 6016;
constexpr int kClutterHeightPx = 4000;

/// A photograph (CV_8UC1, blurred, noisy) full of what a detector could take for a marker but is none: black
/// squares on white with random cells in them, plain and nested squares, chessboards, writing, bolts,
/// texture.
[[nodiscard]] cv::Mat clutter_photograph(std::uint64_t seed);

}  // namespace hexcal
