#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace hexcal {

/// Outline of a dark region, or of a bright hole in one, that has four straight sides. Clockwise in the image
/// (x right, y down), within about 2 px.
struct Quad {
  std::array<Eigen::Vector2d, 4> corners_px;
};

/// Candidates for markers with sides of at least `min_side_px`, in the order of their place in the
/// photograph. The photograph (CV_8UC1) is searched at half its size, in tiles that adapt to the light as
/// AprilTag's do (Wang & Olson 2016); regions too small there are looked at again at full size. A side may be
/// broken and one corner covered.
[[nodiscard]] std::vector<Quad> find_quads(const cv::Mat& grey, double min_side_px);

}  // namespace hexcal
