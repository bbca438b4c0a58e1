#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "photogrammetry/markers/photometric_fit.h"

namespace hexcal {

/// The fit's plane: ideal pixels, shifted to the marker's middle and divided by half its side.
struct FitFrame {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();  ///< ideal px
  double half_side = 1;                              ///< ideal px
  Eigen::Vector2d middle_px = Eigen::Vector2d::Zero();
};

/// Homography of the fit's plane to the square, its corners at (+-1, +-1), x right, y down, stored row by row
/// without the last element, which is 1.
using InverseHomography = Eigen::Matrix<double, 8, 1>;

/// The square's coordinates of a point and their derivatives by it.
struct SquarePoint {
  Eigen::Vector2d t;
  Eigen::Matrix2d by_point;
  double scale;  ///< 1 / denominator
};
[[nodiscard]] inline SquarePoint square_point(const InverseHomography& g, const Eigen::Vector2d& n) {
  SquarePoint p;
  p.scale = 1 / (g[6] * n.x() + g[7] * n.y() + 1);
  p.t = Eigen::Vector2d(g[0] * n.x() + g[1] * n.y() + g[2], g[3] * n.x() + g[4] * n.y() + g[5]) * p.scale;
  p.by_point << g[0] - p.t.x() * g[6], g[1] - p.t.x() * g[7], g[3] - p.t.y() * g[6], g[4] - p.t.y() * g[7];
  p.by_point *= p.scale;
  return p;
}

/// From four points of the fit's plane, in the order of a marker's corners; none if they are no convex
/// quadrilateral seen from its front.
[[nodiscard]] std::optional<InverseHomography> homography_from_corners(
    const std::array<Eigen::Vector2d, 4>& corners);

struct FitPixel {
  Eigen::Vector2d point;    ///< in the fit's plane, for the stand-in lens as it is
  Eigen::Matrix2d by_px;    ///< its derivatives by the pixel
  Eigen::Matrix2d by_lens;  ///< and by the lens stand-in; only if that is free
  Eigen::Vector2d offset;   ///< of the pixel from the marker's middle in half sides, for the illumination
  double value;             ///< encoded, share of full scale
  double weight = 0;        ///< 1 / standard deviation of noise
  int cell = 0;             ///< cell of the pattern with its ring, for occlusion
  int block = 0;            ///< block of 8 x 8 pixels, JPEG's grid
  bool kept = true;
};

struct FitPixels {
  std::vector<FitPixel> pixels;
  int clipped = 0;  ///< left out
};

struct PixelSelection {
  InverseHomography homography;
  FitFrame frame;
  double reach_px = 4;  ///< around transitions
  double near_px = 1;   ///< where thinning takes four times as many
  int max_pixels = 0;   ///< thinned to about so many
};

/// The pixels around the pattern's transitions, by blocks of 8 x 8.
[[nodiscard]] FitPixels select_pixels(const cv::Mat& grey, const PhotographModel& photograph,
                                      const PixelMapPatch& patch, const FitRequest& request,
                                      const cv::Rect& box, const PixelSelection& selection);

}  // namespace hexcal
