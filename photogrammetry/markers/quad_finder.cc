#include "photogrammetry/markers/quad_finder.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

namespace hexcal {
namespace {

constexpr int kTile = 4;
constexpr int kMinTileContrast = 18;        // encoded 8-bit values within a tile's neighbourhood
constexpr double kSmallOutline = 22;        // px of the searched image: looked at again at full size
constexpr double kMinSupport = 0.55;        // share of the outline's hull that the outline follows
constexpr double kPolygonTolerance = 0.03;  // of the perimeter
constexpr int kHalvingPixels = 3'000'000;   // larger photographs are searched at half size

using Corners = std::array<Eigen::Vector2d, 4>;

// Smallest and largest value of each tile.
struct Tiles {
  cv::Mat low, high;
};

Tiles tile_extremes(const cv::Mat& grey) {
  const int rows = grey.rows / kTile;
  const int columns = grey.cols / kTile;
  Tiles tiles{cv::Mat(rows, columns, CV_8UC1), cv::Mat(rows, columns, CV_8UC1)};
  std::vector<std::uint8_t> low(static_cast<std::size_t>(columns * kTile));
  std::vector<std::uint8_t> high(low.size());
  for (int y = 0; y < rows; ++y) {
    const std::uint8_t* first = grey.ptr(y * kTile);
    std::copy(first, first + low.size(), low.begin());
    std::copy(first, first + high.size(), high.begin());
    for (int k = 1; k < kTile; ++k) {
      const std::uint8_t* row = grey.ptr(y * kTile + k);
      for (std::size_t x = 0; x < low.size(); ++x) {
        low[x] = std::min(low[x], row[x]);
        high[x] = std::max(high[x], row[x]);
      }
    }
    for (int x = 0; x < columns; ++x) {
      const auto at = static_cast<std::size_t>(x * kTile);
      tiles.low.at<std::uint8_t>(y, x) =
          std::min(std::min(low[at], low[at + 1]), std::min(low[at + 2], low[at + 3]));
      tiles.high.at<std::uint8_t>(y, x) =
          std::max(std::max(high[at], high[at + 1]), std::max(high[at + 2], high[at + 3]));
    }
  }
  return tiles;
}

// 255 where darker than the middle of the neighbourhood's extremes; flat neighbourhoods count as bright.
cv::Mat dark_mask(const cv::Mat& grey) {
  Tiles tiles = tile_extremes(grey);
  const cv::Mat neighbours = cv::Mat::ones(3, 3, CV_8UC1);
  cv::erode(tiles.low, tiles.low, neighbours);
  cv::dilate(tiles.high, tiles.high, neighbours);
  cv::Mat mask(grey.rows, grey.cols, CV_8UC1);
  std::vector<std::uint8_t> threshold(static_cast<std::size_t>(grey.cols));
  for (int y = 0; y < grey.rows; ++y) {
    const int tile_row = std::min(y / kTile, tiles.low.rows - 1);
    if (y % kTile == 0) {
      const std::uint8_t* low = tiles.low.ptr(tile_row);
      const std::uint8_t* high = tiles.high.ptr(tile_row);
      for (int x = 0; x < grey.cols; ++x) {
        const int tile = std::min(x / kTile, tiles.low.cols - 1);
        threshold[static_cast<std::size_t>(x)] =
            high[tile] - low[tile] < kMinTileContrast
                ? std::uint8_t{0}
                : static_cast<std::uint8_t>((high[tile] + low[tile] + 1) / 2);
      }
    }
    const std::uint8_t* row = grey.ptr(y);
    std::uint8_t* out = mask.ptr(y);
    const std::uint8_t* limit = threshold.data();
    for (int x = 0; x < grey.cols; ++x) out[x] = row[x] < limit[x] ? 255 : 0;
  }
  return mask;
}

Eigen::Vector2d vector_of(const cv::Point& p) { return {static_cast<double>(p.x), static_cast<double>(p.y)}; }

// The polygon with its shortest side taken out and the neighbouring sides extended until they meet.
std::optional<std::vector<Eigen::Vector2d>> without_shortest_side(
    const std::vector<Eigen::Vector2d>& polygon) {
  const std::size_t n = polygon.size();
  std::size_t shortest = 0;
  for (std::size_t i = 1; i < n; ++i) {
    const auto length = [&](std::size_t k) { return (polygon[(k + 1) % n] - polygon[k]).squaredNorm(); };
    if (length(i) < length(shortest)) shortest = i;
  }
  const Eigen::Vector2d a = polygon[(shortest + n - 1) % n];
  const Eigen::Vector2d b = polygon[shortest];
  const Eigen::Vector2d c = polygon[(shortest + 1) % n];
  const Eigen::Vector2d d = polygon[(shortest + 2) % n];
  const Eigen::Vector2d u = b - a;
  const Eigen::Vector2d v = c - d;
  const double cross = u.x() * v.y() - u.y() * v.x();
  if (std::abs(cross) < 0.1 * u.norm() * v.norm()) return std::nullopt;
  const Eigen::Vector2d w = d - a;
  const double along = (w.x() * v.y() - w.y() * v.x()) / cross;
  if (along < 1) return std::nullopt;
  std::vector<Eigen::Vector2d> result;
  for (std::size_t i = 0; i < n; ++i) {
    if (i == shortest) {
      result.emplace_back(a + along * u);
    } else if (i != (shortest + 1) % n) {
      result.push_back(polygon[i]);
    }
  }
  return result;
}

struct Side {
  Eigen::Vector2d point, direction;
};

// Line through the outline's points along one side of the polygon, moved outward by `outward` px.
std::optional<Side> fit_side(const std::vector<cv::Point>& outline, const Eigen::Vector2d& from,
                             const Eigen::Vector2d& to, double outward) {
  const Eigen::Vector2d along = to - from;
  const double length = along.norm();
  if (length < 2) return std::nullopt;
  const Eigen::Vector2d direction = along / length;
  const Eigen::Vector2d normal(direction.y(), -direction.x());
  const double tolerance = std::max(1.2, 0.02 * length);
  double count = 0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  for (const cv::Point& p : outline) {
    const Eigen::Vector2d d = vector_of(p) - from;
    const double share = d.dot(direction) / length;
    if (share < 0.06 || share > 0.94 || std::abs(d.dot(normal)) > tolerance) continue;
    count += 1;
    sum += d;
    squares += d * d.transpose();
  }
  if (count < 3) return Side{from + outward * normal, direction};
  const Eigen::Vector2d mean = sum / count;
  const Eigen::Matrix2d spread = squares / count - mean * mean.transpose();
  const double angle = 0.5 * std::atan2(2 * spread(0, 1), spread(0, 0) - spread(1, 1));
  return Side{from + mean + outward * normal, {std::cos(angle), std::sin(angle)}};
}

// Share of the hull's length that points of the outline follow.
double hull_support(const std::vector<cv::Point>& outline, const std::vector<Eigen::Vector2d>& polygon) {
  double length = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i)
    length += (polygon[(i + 1) % polygon.size()] - polygon[i]).norm();
  int near = 0;
  for (const cv::Point& p : outline) {
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Eigen::Vector2d along = (polygon[(i + 1) % polygon.size()] - polygon[i]).normalized();
      const Eigen::Vector2d d = vector_of(p) - polygon[i];
      if (std::abs(d.x() * along.y() - d.y() * along.x()) < std::max(1.5, 0.015 * length / 4)) {
        ++near;
        break;
      }
    }
  }
  // A digital line has between 0.7 and 1 points per unit of length.
  return near / (0.8 * length);
}

std::optional<Corners> quad_of_outline(const std::vector<cv::Point>& outline, double min_side) {
  std::vector<cv::Point> hull;
  cv::convexHull(outline, hull, true);
  if (hull.size() < 4) return std::nullopt;
  const double perimeter = cv::arcLength(hull, true);
  std::vector<cv::Point> simple;
  cv::approxPolyDP(hull, simple, kPolygonTolerance * perimeter, true);
  if (simple.size() < 4 || simple.size() > 6) return std::nullopt;
  std::vector<Eigen::Vector2d> polygon;
  for (const cv::Point& p : simple) polygon.push_back(vector_of(p));
  if (hull_support(outline, polygon) < kMinSupport) return std::nullopt;
  while (polygon.size() > 4) {
    auto fewer = without_shortest_side(polygon);
    if (!fewer) return std::nullopt;
    polygon = std::move(*fewer);
  }
  double area = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    area += 0.5 * (polygon[i].x() * polygon[(i + 1) % 4].y() - polygon[i].y() * polygon[(i + 1) % 4].x());
  }
  if (area < 0) std::reverse(polygon.begin(), polygon.end());
  if (std::abs(area) < min_side * min_side * 0.15) return std::nullopt;
  // The outline runs on dark pixels: the edge lies half a pixel outside a region, half a pixel inside a
  // hole's rim.
  const bool hole = cv::contourArea(outline, true) > 0;
  std::array<Side, 4> sides;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto side = fit_side(outline, polygon[i], polygon[(i + 1) % 4], hole ? -0.5 : 0.5);
    if (!side) return std::nullopt;
    sides[i] = *side;
  }
  Corners corners;
  for (std::size_t i = 0; i < 4; ++i) {
    const Side& a = sides[(i + 3) % 4];
    const Side& b = sides[i];
    const double cross = a.direction.x() * b.direction.y() - a.direction.y() * b.direction.x();
    if (std::abs(cross) < 0.1) return std::nullopt;
    const Eigen::Vector2d d = b.point - a.point;
    corners[i] = a.point + a.direction * ((d.x() * b.direction.y() - d.y() * b.direction.x()) / cross);
    if ((corners[i] - polygon[i]).norm() > 4 + 0.1 * perimeter / 4) return std::nullopt;
  }
  return corners;
}

// Pixel in the photograph of a pixel in an image of it at 1 / `factor` of the size that starts at `origin`.
Eigen::Vector2d to_photograph(const Eigen::Vector2d& p, double factor, const Eigen::Vector2d& origin) {
  return (p + Eigen::Vector2d::Constant(0.5)) * factor - Eigen::Vector2d::Constant(0.5) + origin;
}

// A small region again, at twice the photograph's size and with one threshold.
std::optional<Corners> look_closer(const cv::Mat& grey, const cv::Rect& region, double min_side_px) {
  const cv::Rect box = cv::Rect(region.x - 4, region.y - 4, region.width + 8, region.height + 8) &
                       cv::Rect(0, 0, grey.cols, grey.rows);
  cv::Mat large;
  cv::resize(grey(box), large, {}, 2, 2, cv::INTER_CUBIC);
  double low = 0;
  double high = 0;
  cv::minMaxLoc(large, &low, &high);
  if (high - low < kMinTileContrast) return std::nullopt;
  const cv::Mat mask = large < 0.5 * (low + high);
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(mask, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  const auto longest = std::max_element(outlines.begin(), outlines.end(),
                                        [](const auto& a, const auto& b) { return a.size() < b.size(); });
  if (longest == outlines.end()) return std::nullopt;
  auto corners = quad_of_outline(*longest, 2 * min_side_px);
  if (!corners) return std::nullopt;
  for (auto& corner : *corners)
    corner = to_photograph(corner, 0.5, {static_cast<double>(box.x), static_cast<double>(box.y)});
  return corners;
}

}  // namespace

std::vector<Quad> find_quads(const cv::Mat& grey, double min_side_px) {
  std::vector<Quad> quads;
  if (grey.rows < 4 * kTile || grey.cols < 4 * kTile) return quads;
  const int factor = grey.total() > kHalvingPixels ? 2 : 1;
  cv::Mat searched = grey;
  if (factor > 1) cv::resize(grey, searched, {grey.cols / factor, grey.rows / factor}, 0, 0, cv::INTER_AREA);
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(dark_mask(searched), outlines, cv::RETR_LIST, cv::CHAIN_APPROX_NONE);
  const double min_side = min_side_px / factor;
  for (const auto& outline : outlines) {
    // Foreshortened to a quarter, a marker's outline is still 2.5 sides long.
    if (static_cast<double>(outline.size()) < 1.8 * min_side) continue;
    const cv::Rect box = cv::boundingRect(outline);
    if (std::max(box.width, box.height) < 0.7 * min_side) continue;
    if (std::max(box.width, box.height) < kSmallOutline) {
      const cv::Rect region(box.x * factor, box.y * factor, box.width * factor, box.height * factor);
      if (const auto corners = look_closer(grey, region, 0.8 * min_side_px)) quads.push_back({*corners});
      continue;
    }
    auto corners = quad_of_outline(outline, min_side);
    if (!corners) continue;
    for (auto& corner : *corners) corner = to_photograph(corner, factor, Eigen::Vector2d::Zero());
    quads.push_back({*corners});
  }
  return quads;
}

}  // namespace hexcal
