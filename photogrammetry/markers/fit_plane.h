#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "photogrammetry/markers/pixel_map.h"

namespace hexcal {

/// The plane in which a marker is fitted: ideal pixels, shifted to its middle and divided by half its side.
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

/// Derivatives of the square's coordinates of the plane's point n by the homography.
[[nodiscard]] inline Eigen::Matrix<double, 2, 8> square_by_homography(const SquarePoint& p,
                                                                      const Eigen::Vector2d& n) {
  Eigen::Matrix<double, 2, 8> d;
  d << n.x(), n.y(), 1, 0, 0, 0, -p.t.x() * n.x(), -p.t.x() * n.y(),  //
      0, 0, 0, n.x(), n.y(), 1, -p.t.y() * n.x(), -p.t.y() * n.y();
  return d * p.scale;
}

/// From four points of the fit's plane, in the order of a marker's corners; none if they are no convex
/// quadrilateral seen from its front.
[[nodiscard]] std::optional<InverseHomography> homography_from_corners(
    const std::array<Eigen::Vector2d, 4>& corners);

/// A marker's square in its own plane.
struct FitPlane {
  FitFrame frame;
  InverseHomography homography;

  /// From the corners' pixels; none where the map is not defined or they are no square seen from its front.
  [[nodiscard]] static std::optional<FitPlane> from_corners(const PixelMap& map,
                                                            const std::array<Eigen::Vector2d, 4>& corners_px);

  struct Pixel {
    Eigen::Vector2d px;
    Eigen::Matrix<double, 2, 8> by_homography;
  };
  /// Image of a point of the square.
  [[nodiscard]] Pixel pixel(const PixelMap& map, const Eigen::Vector2d& t) const;

  struct Corners {
    std::array<Eigen::Vector2d, 4> px;
    Eigen::Matrix<double, 8, 8> by_homography;
  };
  [[nodiscard]] Corners corners(const PixelMap& map) const;
};

}  // namespace hexcal
