#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core/mat.hpp>

#include "photogrammetry/markers/blurred_pattern.h"
#include "photogrammetry/markers/pixel_map.h"

namespace hexcal {

/// A marker measured by the places of its edges alone.
struct EdgeFit {
  bool converged = false;
  std::array<Eigen::Vector2d, 4> corners_px;
  Eigen::Matrix<double, 8, 8> covariance_px2;
  double visible = 0;     ///< share of the pattern's edges, cell by cell, that lie where the fit puts them
  double scatter_px = 0;  ///< of an edge's place about the fit, robust standard deviation
  double bleed_px = 0;    ///< by which every edge lies on the black side of where it is printed
  double contrast = 0;    ///< median step over full scale, of encoded values
};

/// Where the photometric model does not hold (a picture sharpened, smoothed or clipped beyond what it knows),
/// an edge still stands where grey passes the middle between its two sides. All edges of the pattern, each
/// side of a cell that parts black from white, are looked up along their normals; one homography and one
/// bleed, the same for all edges across, are fitted to them with Tukey's biweight. Edges of both directions,
/// within the pattern and around it, tell bleed from size. The covariance is what the edges disagree by,
/// clustered by cell sides (White 1980), so that it needs no model of the noise.
/// `corners_px` within about a third of a cell.
[[nodiscard]] EdgeFit fit_edges(const cv::Mat& grey, const PixelMap& map, const BlurredPattern& pattern,
                                double square_cells, const std::array<Eigen::Vector2d, 4>& corners_px);

}  // namespace hexcal
