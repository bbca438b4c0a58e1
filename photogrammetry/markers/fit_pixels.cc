#include "photogrammetry/markers/fit_pixels.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace hexcal {
namespace {

// A pseudo-random number of a pixel: thinning must not alias with the pattern.
std::uint32_t pixel_lot(int x, int y) {
  std::uint32_t h = static_cast<std::uint32_t>(x) * 0x9E3779B1U ^ static_cast<std::uint32_t>(y) * 0x85EBCA77U;
  h ^= h >> 15;
  h *= 0x2C1B3C6DU;
  h ^= h >> 12;
  h *= 0x297A2D39U;
  h ^= h >> 15;
  return h;
}

// Pixels of the row y that can be near the square grown by `margin` (in half sides of the square).
struct Span {
  int first, last;
};
Span span_in_row(const std::array<Eigen::Vector2d, 4>& hull, double y, const cv::Rect& box) {
  double left = std::numeric_limits<double>::infinity();
  double right = -left;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d& a = hull[i];
    const Eigen::Vector2d& b = hull[(i + 1) % 4];
    // The part of the side within half a pixel row.
    const double low = std::max(std::min(a.y(), b.y()), y - 1);
    const double high = std::min(std::max(a.y(), b.y()), y + 1);
    if (low > high) continue;
    for (const double at : {low, high}) {
      const double share = std::abs(b.y() - a.y()) < 1e-9 ? 0.0 : (at - a.y()) / (b.y() - a.y());
      const double x = a.x() + share * (b.x() - a.x());
      left = std::min(left, x);
      right = std::max(right, x);
    }
    if (std::abs(b.y() - a.y()) < 1e-9) {
      left = std::min(left, b.x());
      right = std::max(right, b.x());
    }
  }
  if (!(left <= right)) return {0, -1};
  return {std::max(static_cast<int>(std::floor(left)) - 1, box.x),
          std::min(static_cast<int>(std::ceil(right)) + 1, box.x + box.width - 1)};
}

}  // namespace

std::optional<InverseHomography> homography_from_corners(const std::array<Eigen::Vector2d, 4>& corners) {
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d a = corners[(i + 1) % 4] - corners[i];
    const Eigen::Vector2d b = corners[(i + 2) % 4] - corners[(i + 1) % 4];
    if (!(a.x() * b.y() - a.y() * b.x() > 1e-12)) return std::nullopt;
  }
  static constexpr double kSquare[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  Eigen::Matrix<double, 8, 8> a = Eigen::Matrix<double, 8, 8>::Zero();
  Eigen::Matrix<double, 8, 1> b;
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector2d& n = corners[static_cast<std::size_t>(i)];
    for (int k = 0; k < 2; ++k) {
      const double t = kSquare[i][k];
      a.block<1, 3>(2 * i + k, 3 * k) << n.x(), n.y(), 1;
      a.block<1, 2>(2 * i + k, 6) = -t * n.transpose();
      b[2 * i + k] = t;
    }
  }
  const InverseHomography g = a.partialPivLu().solve(b);
  if (!g.allFinite()) return std::nullopt;
  return g;
}

FitPixels select_pixels(const cv::Mat& grey, const PhotographModel& photograph, const PixelMapPatch& patch,
                        const FitRequest& request, const cv::Rect& box, const PixelSelection& selection) {
  FitPixels result;
  const FitFrame& frame = selection.frame;
  const double half_square = 0.5 * request.square_cells;
  const double half_pattern = 0.5 * request.pattern.cells();
  const double scale = 1 / full_scale(grey);
  const bool wide = grey.depth() == CV_16U;
  const double px_to_plane = 1 / frame.half_side;

  // Outline of what can be near a transition, in pixels: the pattern grown by the reach.
  std::array<Eigen::Vector2d, 4> hull;
  {
    static constexpr double kSquare[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    Eigen::Matrix3d g;
    g << selection.homography[0], selection.homography[1], selection.homography[2], selection.homography[3],
        selection.homography[4], selection.homography[5], selection.homography[6], selection.homography[7], 1;
    const Eigen::Matrix3d h = g.inverse();
    const double extent = std::min(half_pattern, request.window_cells) / half_square;
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector3d n = h * Eigen::Vector3d(kSquare[i][0] * extent, kSquare[i][1] * extent, 1);
      hull[i] = photograph.map.pixel_from_ideal(frame.middle + n.hnormalized() * frame.half_side, nullptr);
    }
    // A corner moved out by the reach over the sine of half its angle; steep views have sharp corners.
    std::array<Eigen::Vector2d, 4> grown = hull;
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector2d to_next = (hull[(i + 1) % 4] - hull[i]).normalized();
      const Eigen::Vector2d to_last = (hull[(i + 3) % 4] - hull[i]).normalized();
      const double sine = std::max(std::abs(to_next.x() * to_last.y() - to_next.y() * to_last.x()), 0.1);
      grown[i] -= (to_next + to_last) * (selection.reach_px / sine);
    }
    hull = grown;
  }

  // Most of a large marker is far from any transition: whole tiles of 8 x 8 pixels are passed over when the
  // pattern does not change within the reach of any of their pixels. Within a tile the map to cells is taken
  // as linear when the single pixels are looked at.
  constexpr int kTile = 8;
  constexpr double kTileReach = 1.1 * kTile;  // half its diagonal, 5.7 px, and perspective within it
  struct Tile {
    bool wanted = false;
    Eigen::Vector2d cells;  // of its middle
    Eigen::Matrix2d by_px;
    Eigen::Vector2d reach;  // of one pixel, in cells
  };
  constexpr double kMiddle = 0.5 * (kTile - 1);
  std::vector<Tile> tiles(static_cast<std::size_t>(box.width / kTile + 1));
  const auto look_at_tiles = [&](int top) {
    const PixelMapPatch::Row row = patch.row(top + kMiddle);
    int left = box.x;
    for (Tile& tile : tiles) {
      const PixelMapPatch::Point ideal = row.at(left + kMiddle);
      left += kTile;
      const SquarePoint square =
          square_point(selection.homography, (ideal.ideal - frame.middle) * px_to_plane);
      tile.by_px = square.by_point * ideal.by_px * (px_to_plane * half_square);
      tile.cells = square.t * half_square + Eigen::Vector2d::Constant(half_pattern);
      tile.reach = tile.by_px.rowwise().norm();
      const double reach = selection.reach_px + kTileReach;
      tile.wanted =
          square.scale > 0 && request.pattern.has_transition(tile.cells.x(), tile.cells.y(),
                                                             reach * tile.reach.x(), reach * tile.reach.y());
    }
  };

  // Thinning needs the number of candidates: about the share of the outline's area. Pixels near a transition
  // tell most of its place, those farther off the levels.
  double area = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    area += 0.5 * (hull[i].x() * hull[(i + 1) % 4].y() - hull[i].y() * hull[(i + 1) % 4].x());
  }
  const double cell_px = 2 * frame.half_side / request.square_cells;
  const auto within = [&](double reach) {
    return std::abs(area) * std::min(1.0, 1.6 * reach / std::max(cell_px, 1e-9));
  };
  const double all = within(selection.reach_px);
  const double near = std::min(within(selection.near_px), all);
  const double share = selection.max_pixels / std::max(near + (all - near) / 4, 1.0);
  const auto most_of = [](double taken) { return static_cast<std::uint64_t>(0x1p32 * std::min(taken, 1.0)); };
  const std::uint64_t near_lots = most_of(share);
  const std::uint64_t far_lots = most_of(share / 4);

  const auto take = [&](int x, int y, const Tile& tile, const Eigen::Vector2d& from_middle,
                        const PixelMapPatch::Row& row) {
    const std::uint32_t lot = pixel_lot(x, y);
    if (lot >= near_lots) return;
    const Eigen::Vector2d about = tile.cells + tile.by_px * from_middle;
    const double reach = lot < far_lots ? selection.reach_px : selection.near_px;
    if (!request.pattern.has_transition(about.x(), about.y(), reach * tile.reach.x(), reach * tile.reach.y()))
      return;
    const PixelMapPatch::Point ideal = row.at(x);
    FitPixel pixel;
    pixel.point = (ideal.ideal - frame.middle) * px_to_plane;
    pixel.by_px = ideal.by_px * px_to_plane;
    const SquarePoint square = square_point(selection.homography, pixel.point);
    if (!(square.scale > 0)) return;
    const Eigen::Vector2d u = square.t * half_square + Eigen::Vector2d::Constant(half_pattern);
    if ((u.array() - half_pattern).abs().maxCoeff() > request.window_cells) return;
    const int raw = wide ? grey.at<std::uint16_t>(y, x) : grey.at<std::uint8_t>(y, x);
    if (raw == 0 || raw == (wide ? 65535 : 255)) {
      ++result.clipped;
      return;
    }
    pixel.value = raw * scale;
    pixel.weight = 1 / std::sqrt(photograph.noise.variance(pixel.value));
    if (request.free_lens) {
      pixel.by_lens =
          photograph.map.by_stand_in({static_cast<double>(x), static_cast<double>(y)}) * px_to_plane;
    }
    pixel.offset = (Eigen::Vector2d(x, y) - frame.middle_px) * px_to_plane;
    const int cells = request.pattern.cells();
    const auto cell_of = [cells](double at) {
      return std::clamp(static_cast<int>(std::floor(at)), -1, cells) + 1;
    };
    pixel.cell = cell_of(u.y()) * (cells + 2) + cell_of(u.x());
    pixel.block = ((y >> 3) - (box.y >> 3)) * ((box.width >> 3) + 2) + ((x >> 3) - (box.x >> 3));
    result.pixels.push_back(pixel);
  };

  for (int y = box.y; y < box.y + box.height; ++y) {
    const int in_tile_y = (y - box.y) % kTile;
    if (in_tile_y == 0) look_at_tiles(y);
    const Span span = span_in_row(hull, y, box);
    if (span.first > span.last) continue;
    const PixelMapPatch::Row row = patch.row(y);
    for (int x = span.first; x <= span.last; ++x) {
      const int at = (x - box.x) / kTile;
      const Tile& tile = tiles[static_cast<std::size_t>(at)];
      const int left = box.x + at * kTile;
      if (tile.wanted) {
        take(x, y, tile, {x - left - kMiddle, in_tile_y - kMiddle}, row);
      } else {
        x = left + kTile - 1;
      }
    }
  }
  return result;
}

}  // namespace hexcal
