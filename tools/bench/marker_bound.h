#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "photogrammetry/markers/marker.h"
#include "tools/synthetic/render.h"

namespace hexcal {

/// What the renderer knows of a marker's image.
struct MarkerImage {
  std::array<Eigen::Vector2d, 4> corners_px;
  double blur_px = 0;
  double black = 0, white = 0;  ///< light, 1 = clipping
};

/// The Cramer-Rao bound of a marker's corners (8x8 covariance, px^2, in the order of MarkerObservation): no
/// unbiased estimator does better from the luminance of an uncompressed 8-bit photograph. Unknown are the
/// corners, black, white and the blur; known are the tone curve, the noise and the lens, which is straight
/// across one marker. None if the corners are no quadrilateral.
[[nodiscard]] std::optional<Eigen::Matrix<double, 8, 8>> corner_bound(const MarkerPattern& pattern,
                                                                      const MarkerImage& image,
                                                                      const SensorOptions& sensor);

}  // namespace hexcal
