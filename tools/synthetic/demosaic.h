#pragma once

#include <array>
#include <opencv2/core/mat.hpp>

#include "tools/synthetic/camera_effects.h"

namespace hexcal {

/// Channel that the filter over a pixel lets through: red at even x and y, blue at odd ones, green elsewhere
/// (RGGB, as the D3200's).
[[nodiscard]] constexpr std::size_t bayer_channel(int x, int y) {
  return static_cast<std::size_t>(x % 2 + y % 2);
}

/// Red, green and blue of every pixel from a mosaic (CV_32FC1, white balanced). Throws InputError for `none`.
[[nodiscard]] std::array<cv::Mat, 3> demosaiced(const cv::Mat& mosaic, Demosaicing method);

}  // namespace hexcal
