#include "photogrammetry/markers/edge_scan.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "photogrammetry/markers/grey_sample.h"
#include "photogrammetry/markers/image_noise.h"

namespace hexcal {
namespace {

constexpr int kPlacesPerSide = 32;
constexpr double kStepPx = 0.5;
constexpr double kMaxReachPx = 6;
constexpr std::size_t kMinPlaces = 5;

struct Line {
  Eigen::Vector2d point, direction;
};

// Least squares with the worst places dropped in rounds.
std::optional<Line> fit_line(std::vector<Eigen::Vector2d> places) {
  for (int round = 0;; ++round) {
    if (places.size() < kMinPlaces) return std::nullopt;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const auto& p : places) mean += p;
    mean /= static_cast<double>(places.size());
    Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
    for (const auto& p : places) spread += (p - mean) * (p - mean).transpose();
    const double angle = 0.5 * std::atan2(2 * spread(0, 1), spread(0, 0) - spread(1, 1));
    const Line line{mean, {std::cos(angle), std::sin(angle)}};
    if (round == 4) return line;
    std::vector<double> distances;
    const auto distance = [&line](const Eigen::Vector2d& p) {
      const Eigen::Vector2d d = p - line.point;
      return std::abs(d.x() * line.direction.y() - d.y() * line.direction.x());
    };
    for (const auto& p : places) distances.push_back(distance(p));
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    const double limit = std::max(3 * *middle, 0.3);
    std::erase_if(places, [&](const Eigen::Vector2d& p) { return distance(p) > limit; });
  }
}

}  // namespace

std::optional<std::array<Eigen::Vector2d, 4>> scan_edges(const cv::Mat& grey, const ToneResponse& tone,
                                                         const BlurredPattern& pattern, double square_cells,
                                                         const std::array<Eigen::Vector2d, 4>& corners_px) {
  const double scale = full_scale(grey);
  const double first_line = 0.5 * (pattern.cells() - square_cells);
  std::array<Line, 4> lines;
  for (std::size_t side = 0; side < 4; ++side) {
    const Eigen::Vector2d from = corners_px[side];
    const Eigen::Vector2d along = corners_px[(side + 1) % 4] - from;
    const Eigen::Vector2d outward = Eigen::Vector2d(along.y(), -along.x()).normalized();
    // A cell's depth across the side: from the neighbouring sides.
    const Eigen::Vector2d next = corners_px[(side + 2) % 4] - corners_px[(side + 1) % 4];
    const Eigen::Vector2d last = corners_px[(side + 3) % 4] - from;
    const double cell_px = std::min(std::abs(next.dot(outward)), std::abs(last.dot(outward))) / square_cells;
    const double reach = std::clamp(0.9 * cell_px, 1.5, kMaxReachPx);
    const bool outside_white = [&] {
      const double at = first_line + 0.5;
      return pattern.is_white(at, first_line - 0.5);
    }();
    std::vector<Eigen::Vector2d> places;
    std::vector<double> profile;
    for (int i = 0; i < kPlacesPerSide; ++i) {
      const Eigen::Vector2d middle = from + along * ((i + 0.5) / kPlacesPerSide * 0.9 + 0.05);
      profile.clear();
      const int steps = static_cast<int>(2 * reach / kStepPx) + 1;
      bool inside_frame = true;
      for (int k = 0; k < steps && inside_frame; ++k) {
        const auto value = grey_sample(grey, middle + outward * (k * kStepPx - reach));
        inside_frame = value.has_value();
        if (inside_frame) profile.push_back(tone.decode(*value / scale));
      }
      if (!inside_frame) continue;
      if (!outside_white) {
        for (double& value : profile) value = -value;
      }
      const auto [low, high] = std::minmax_element(profile.begin(), profile.end());
      // From dark inside to bright outside: the crossing of the middle with the steepest rise.
      const double half = 0.5 * (*low + *high);
      double steepest = 0;
      double crossing = 0;
      for (std::size_t k = 1; k < profile.size(); ++k) {
        if (profile[k - 1] > half || profile[k] <= half) continue;
        const double rise = profile[k] - profile[k - 1];
        if (rise > steepest) {
          steepest = rise;
          crossing = (static_cast<double>(k - 1) + (half - profile[k - 1]) / rise) * kStepPx - reach;
        }
      }
      if (steepest > 0 && *high - *low > 0.01) places.push_back(middle + outward * crossing);
    }
    const auto line = fit_line(std::move(places));
    if (!line) return std::nullopt;
    lines[side] = *line;
  }
  std::array<Eigen::Vector2d, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) {
    const Line& a = lines[(i + 3) % 4];
    const Line& b = lines[i];
    const double cross = a.direction.x() * b.direction.y() - a.direction.y() * b.direction.x();
    if (std::abs(cross) < 0.05) return std::nullopt;
    const Eigen::Vector2d d = b.point - a.point;
    corners[i] = a.point + a.direction * ((d.x() * b.direction.y() - d.y() * b.direction.x()) / cross);
  }
  return corners;
}

}  // namespace hexcal
