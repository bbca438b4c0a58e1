#include "photogrammetry/markers/fit_plane.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace hexcal {
namespace {

constexpr double kSquareCorners[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};

}  // namespace

std::optional<InverseHomography> homography_from_corners(const std::array<Eigen::Vector2d, 4>& corners) {
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d a = corners[(i + 1) % 4] - corners[i];
    const Eigen::Vector2d b = corners[(i + 2) % 4] - corners[(i + 1) % 4];
    if (!(a.x() * b.y() - a.y() * b.x() > 1e-12)) return std::nullopt;
  }
  Eigen::Matrix<double, 8, 8> a = Eigen::Matrix<double, 8, 8>::Zero();
  Eigen::Matrix<double, 8, 1> b;
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector2d& n = corners[static_cast<std::size_t>(i)];
    for (int k = 0; k < 2; ++k) {
      const double t = kSquareCorners[i][k];
      a.block<1, 3>(2 * i + k, 3 * k) << n.x(), n.y(), 1;
      a.block<1, 2>(2 * i + k, 6) = -t * n.transpose();
      b[2 * i + k] = t;
    }
  }
  const InverseHomography g = a.partialPivLu().solve(b);
  if (!g.allFinite()) return std::nullopt;
  return g;
}

std::optional<FitPlane> FitPlane::from_corners(const PixelMap& map,
                                               const std::array<Eigen::Vector2d, 4>& corners_px) {
  std::array<Eigen::Vector2d, 4> ideal;
  Eigen::Vector2d low = corners_px[0];
  Eigen::Vector2d high = low;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto point = map.ideal_from_pixel(corners_px[i]);
    if (!point) return std::nullopt;
    ideal[i] = *point;
    low = low.cwiseMin(corners_px[i]);
    high = high.cwiseMax(corners_px[i]);
  }
  FitPlane plane;
  plane.frame.middle = 0.25 * (ideal[0] + ideal[1] + ideal[2] + ideal[3]);
  double around = 0;
  for (std::size_t i = 0; i < 4; ++i) around += (ideal[(i + 1) % 4] - ideal[i]).norm();
  plane.frame.half_side = around / 8;
  plane.frame.middle_px = 0.5 * (low + high);
  std::array<Eigen::Vector2d, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) corners[i] = (ideal[i] - plane.frame.middle) / plane.frame.half_side;
  const auto g = homography_from_corners(corners);
  if (!g) return std::nullopt;
  plane.homography = *g;
  return plane;
}

FitPlane::Pixel FitPlane::pixel(const PixelMap& map, const Eigen::Vector2d& t) const {
  const InverseHomography& g = homography;
  Eigen::Matrix3d forward;
  forward << g[0], g[1], g[2], g[3], g[4], g[5], g[6], g[7], 1;
  forward = forward.inverse().eval();
  const Eigen::Vector2d n = (forward * t.homogeneous()).hnormalized();
  const SquarePoint square = square_point(g, n);
  Eigen::Matrix2d by_ideal;
  Pixel pixel;
  pixel.px = map.pixel_from_ideal(frame.middle + frame.half_side * n, &by_ideal);
  pixel.by_homography =
      -by_ideal * frame.half_side * square.by_point.inverse() * square_by_homography(square, n);
  return pixel;
}

FitPlane::Corners FitPlane::corners(const PixelMap& map) const {
  Corners out;
  for (int i = 0; i < 4; ++i) {
    const Pixel corner = pixel(map, {kSquareCorners[i][0], kSquareCorners[i][1]});
    out.px[static_cast<std::size_t>(i)] = corner.px;
    out.by_homography.middleRows<2>(2 * i) = corner.by_homography;
  }
  return out;
}

}  // namespace hexcal
