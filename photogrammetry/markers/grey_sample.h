#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>

namespace hexcal {

/// Grey of a photograph (CV_8UC1 or CV_16UC1) between its pixels, bilinear; none outside the frame.
[[nodiscard]] std::optional<double> grey_sample(const cv::Mat& grey, const Eigen::Vector2d& px);

}  // namespace hexcal
