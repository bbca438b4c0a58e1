#include "photogrammetry/markers/fit_pixels.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace hexcal {
namespace {

constexpr int kBlockPx = 8;  // px; JPEG's blocks, on its grid

// A pseudo-random number of a tile: thinning must not alias with the pattern.
std::uint32_t tile_lot(int column, int row) {
  std::uint32_t h =
      static_cast<std::uint32_t>(column) * 0x9E3779B1U ^ static_cast<std::uint32_t>(row) * 0x85EBCA77U;
  h ^= h >> 15;
  h *= 0x2C1B3C6DU;
  h ^= h >> 12;
  h *= 0x297A2D39U;
  h ^= h >> 15;
  return h;
}

// The order in which a tile's pixels are taken, 8 y + x: any first few are spread evenly (Bayer 1973).
constexpr std::array<unsigned, kBlockPx* kBlockPx> kBayerOrder = [] {
  std::array<unsigned, kBlockPx * kBlockPx> order{};
  for (unsigned k = 0; k < order.size(); ++k) {
    unsigned x = 0;
    unsigned y = 0;
    for (unsigned bit = 0; bit < 3; ++bit) {
      const unsigned a = (k >> (2 * bit)) & 1U;
      const unsigned b = (k >> (2 * bit + 1)) & 1U;
      x |= (a ^ b) << (2 - bit);
      y |= a << (2 - bit);
    }
    order[k] = kBlockPx * y + x;
  }
  return order;
}();

// Columns between low and high that a quadrilateral covers in the rows between top and bottom.
struct Span {
  int first, last;
};
Span span_in_rows(const std::array<Eigen::Vector2d, 4>& hull, double top, double bottom,
                  const cv::Rect& box) {
  double left = std::numeric_limits<double>::infinity();
  double right = -left;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d& a = hull[i];
    const Eigen::Vector2d& b = hull[(i + 1) % 4];
    // The part of the side within the rows.
    const double low = std::max(std::min(a.y(), b.y()), top);
    const double high = std::min(std::max(a.y(), b.y()), bottom);
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

FitPixels select_pixels(const cv::Mat& grey, const PhotographModel& photograph, const PixelMapPatch& patch,
                        const FitRequest& request, const cv::Rect& box, const PixelSelection& selection) {
  FitPixels result;
  const FitFrame& frame = selection.frame;
  const double half_square = 0.5 * request.square_cells;
  const double half_pattern = 0.5 * request.pattern.cells();
  const double scale = 1 / full_scale(grey);
  const bool wide = grey.depth() == CV_16U;
  const int black_clip = photograph.noise.black_clip();
  const int white_clip = photograph.noise.white_clip();
  const double px_to_plane = 1 / frame.half_side;

  // Outline of what can be near a transition, in pixels: the pattern grown by the reach.
  std::array<Eigen::Vector2d, 4> hull;
  {
    static constexpr double kSquare[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    Eigen::Matrix3d g;
    g << selection.homography[0], selection.homography[1], selection.homography[2], selection.homography[3],
        selection.homography[4], selection.homography[5], selection.homography[6], selection.homography[7], 1;
    const Eigen::Matrix3d h = g.inverse();
    const double extent =
        (request.window_cells < kNoWindow ? request.window_cells : half_pattern) / half_square;
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
  const auto of_tile = [](double taken) { return kBlockPx * kBlockPx * std::min(taken, 1.0); };
  const double near_share = of_tile(share);
  const double far_share = of_tile(share / 4);

  // Most of a large marker is far from any transition: whole tiles are passed over when the pattern does not
  // change within the reach of any of their pixels. Within a tile the map to cells is taken as linear when
  // the single pixels are looked at.
  constexpr double kMiddle = 0.5 * (kBlockPx - 1);
  constexpr double kTileReach = 1.1 * kBlockPx;  // half its diagonal, 5.7 px, and perspective within it
  struct Tile {
    Eigen::Vector2d cells;  // of its middle
    Eigen::Matrix2d by_px;
    Eigen::Vector2d reach;  // of one pixel, in cells
  };
  const auto tile_at = [&](const PixelMapPatch::Row& middle_row, int left) -> std::optional<Tile> {
    const PixelMapPatch::Point ideal = middle_row.at(left + kMiddle);
    const SquarePoint square = square_point(selection.homography, (ideal.ideal - frame.middle) * px_to_plane);
    if (!(square.scale > 0)) return std::nullopt;
    Tile tile;
    tile.by_px = square.by_point * ideal.by_px * (px_to_plane * half_square);
    tile.cells = square.t * half_square + Eigen::Vector2d::Constant(half_pattern);
    tile.reach = tile.by_px.rowwise().norm();
    const double reach = selection.reach_px + kTileReach;
    if (!request.pattern.has_transition(tile.cells.x(), tile.cells.y(), reach * tile.reach.x(),
                                        reach * tile.reach.y())) {
      return std::nullopt;
    }
    return tile;
  };

  const auto take = [&](int x, int y, double reach, const Tile& tile, const Eigen::Vector2d& from_middle,
                        const PixelMapPatch::Row& row) {
    const Eigen::Vector2d about = tile.cells + tile.by_px * from_middle;
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
    pixel.censored = raw >= white_clip ? 1 : raw <= black_clip ? -1 : 0;
    if (pixel.censored != 0) ++result.clipped;
    // A bound lies half a step inside the value that is shown.
    pixel.value = pixel.censored == 0 ? raw * scale
                                      : (pixel.censored > 0 ? white_clip - 0.5 : black_clip + 0.5) * scale;
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
    pixel.block =
        (y / kBlockPx - box.y / kBlockPx) * (box.width / kBlockPx + 2) + (x / kBlockPx - box.x / kBlockPx);
    result.pixels.push_back(pixel);
  };

  const int bottom = box.y + box.height - 1;
  std::array<PixelMapPatch::Row, kBlockPx> rows;
  for (int tile_row = box.y / kBlockPx; tile_row <= bottom / kBlockPx; ++tile_row) {
    const int top = tile_row * kBlockPx;
    const Span span = span_in_rows(hull, top - 1, top + kBlockPx, box);
    if (span.first > span.last) continue;
    const PixelMapPatch::Row middle_row = patch.row(top + kMiddle);
    for (int i = 0; i < kBlockPx; ++i) rows[static_cast<std::size_t>(i)] = patch.row(top + i);
    for (int column = span.first / kBlockPx; column <= span.last / kBlockPx; ++column) {
      const int left = column * kBlockPx;
      const std::optional<Tile> tile = tile_at(middle_row, left);
      if (!tile) continue;
      const std::uint32_t lot = tile_lot(column, tile_row);
      const double rounding = (lot >> 6) * 0x1p-26;  // at random, so that parts of a pixel count
      const auto near_pixels = static_cast<std::size_t>(near_share + rounding);
      const auto far_pixels = static_cast<std::size_t>(far_share + rounding);
      for (std::size_t k = 0; k < near_pixels; ++k) {
        const auto at = static_cast<int>(kBayerOrder[k] ^ (lot & 63U));
        const int in_x = at % kBlockPx;
        const int in_y = at / kBlockPx;
        const int x = left + in_x;
        const int y = top + in_y;
        if (x < box.x || x >= box.x + box.width || y < box.y || y > bottom) continue;
        take(x, y, k < far_pixels ? selection.reach_px : selection.near_px, *tile,
             {in_x - kMiddle, in_y - kMiddle}, rows[static_cast<std::size_t>(in_y)]);
      }
    }
  }
  return result;
}

}  // namespace hexcal
