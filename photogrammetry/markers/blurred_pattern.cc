#include "photogrammetry/markers/blurred_pattern.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "photogrammetry/markers/normal_distribution.h"

namespace hexcal {
namespace {

// Beyond this many standard deviations a transition changes a value by less than 2e-4.
constexpr double kReachSigmas = 3.6;
constexpr std::size_t kMaxLines = 16;

// std::floor within [-1, cells + 1], -1 for what is no number: clamped before the conversion, because a fit
// that runs away asks for places that no int can hold, and rounded by it, which is faster than the library's.
int floor_within(double at, int cells) {
  const double clamped = at > -1.0 ? (at < cells + 1.0 ? at : cells + 1.0) : -1.0;
  return static_cast<int>(clamped + 1) - 1;
}

// The grid lines of one direction in reach of a point.
struct Lines {
  int first_cell = 0;  // the cell before the first line
  int count = 0;
  std::array<double, kMaxLines> distance;  // in standard deviations, positive beyond the line
  std::array<NormalValue, kMaxLines> normal;
};

void find_lines(double at, double sigma, int cells, Lines& lines) {
  const double least = at - kReachSigmas * sigma;
  const int below = floor_within(least, cells);
  const int first = std::max(below < least ? below + 1 : below, 0);
  const int last = std::min(floor_within(at + kReachSigmas * sigma, cells), cells);
  lines.count = std::max(last - first + 1, 0);
  assert(lines.count <= static_cast<int>(kMaxLines));
  lines.first_cell = lines.count > 0 ? first - 1 : std::min(floor_within(at, cells), cells);
  for (int i = 0; i < lines.count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    lines.distance[k] = (at - (first + i)) / sigma;
    lines.normal[k] = standard_normal(lines.distance[k]);
  }
}

}  // namespace

BlurredPattern::BlurredPattern(const MarkerPattern& pattern) : cells_(pattern.cells) {
  const int side = cells_ + 2;
  white_.assign(static_cast<std::size_t>(side * side), 1.0);
  for (int y = 0; y < cells_; ++y) {
    for (int x = 0; x < cells_; ++x) {
      white_[static_cast<std::size_t>((y + 1) * side + x + 1)] =
          pattern.white[static_cast<std::size_t>(y * cells_ + x)];
    }
  }
}

BlurredPattern BlurredPattern::saddle() {
  BlurredPattern pattern;
  pattern.cells_ = 2;
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 4; ++x) pattern.white_.push_back((x < 2) == (y < 2) ? 1.0 : 0.0);
  }
  return pattern;
}

BlurredPattern BlurredPattern::saddle_between_markers() {
  BlurredPattern pattern;
  pattern.cells_ = 4;
  for (int y = 0; y < 6; ++y) {
    for (int x = 0; x < 6; ++x) {
      const bool marker = (x < 2 || x > 3) && (y < 2 || y > 3);
      pattern.white_.push_back((x < 3) == (y < 3) && !marker ? 1.0 : 0.0);
    }
  }
  return pattern;
}

PatternSample BlurredPattern::sample(double x, double y, const Symmetric2& blur) const {
  const double sx = std::sqrt(blur.xx);
  const double sy = std::sqrt(blur.yy);
  Lines columns;
  Lines rows;
  find_lines(x, sx, cells_, columns);
  find_lines(y, sy, cells_, rows);
  const int x0 = columns.first_cell;
  const int y0 = rows.first_cell;
  PatternSample s{cell(x0, y0), 0, 0, {0, 0, 0}};
  // Derivatives by the standardised distances first.
  for (int i = 0; i < columns.count; ++i) {
    const double step = cell(x0 + i + 1, y0) - cell(x0 + i, y0);
    if (step == 0) continue;
    const auto k = static_cast<std::size_t>(i);
    s.value += step * columns.normal[k].cdf;
    s.by_x += step * columns.normal[k].density;
    s.second.xx -= step * columns.distance[k] * columns.normal[k].density;
  }
  for (int j = 0; j < rows.count; ++j) {
    const double step = cell(x0, y0 + j + 1) - cell(x0, y0 + j);
    if (step == 0) continue;
    const auto k = static_cast<std::size_t>(j);
    s.value += step * rows.normal[k].cdf;
    s.by_y += step * rows.normal[k].density;
    s.second.yy -= step * rows.distance[k] * rows.normal[k].density;
  }
  if (columns.count > 0 && rows.count > 0) {
    const double rho = std::clamp(blur.xy / (sx * sy), -0.998, 0.998);
    const double q = std::sqrt(1 - rho * rho);
    for (int j = 0; j < rows.count; ++j) {
      for (int i = 0; i < columns.count; ++i) {
        const double step = cell(x0 + i + 1, y0 + j + 1) - cell(x0 + i, y0 + j + 1) -
                            cell(x0 + i + 1, y0 + j) + cell(x0 + i, y0 + j);
        if (step == 0) continue;
        const double a = columns.distance[static_cast<std::size_t>(i)];
        const double b = rows.distance[static_cast<std::size_t>(j)];
        const NormalValue& at_a = columns.normal[static_cast<std::size_t>(i)];
        const NormalValue& at_b = rows.normal[static_cast<std::size_t>(j)];
        const NormalValue b_given_a = standard_normal((b - rho * a) / q);
        const NormalValue a_given_b = standard_normal((a - rho * b) / q);
        const double joint_density = at_a.density * b_given_a.density / q;
        const double by_a = at_a.density * b_given_a.cdf;
        const double by_b = at_b.density * a_given_b.cdf;
        s.value += step * bivariate_normal_cdf(a, b, rho, at_a, at_b);
        s.by_x += step * by_a;
        s.by_y += step * by_b;
        s.second.xx -= step * (a * by_a + rho * joint_density);
        s.second.yy -= step * (b * by_b + rho * joint_density);
        s.second.xy += step * joint_density;
      }
    }
  }
  s.by_x /= sx;
  s.by_y /= sy;
  s.second.xx /= blur.xx;
  s.second.xy /= sx * sy;
  s.second.yy /= blur.yy;
  return s;
}

bool BlurredPattern::has_transition(double x, double y, double reach_x, double reach_y) const {
  const auto cell_of = [this](double at) { return std::min(floor_within(at, cells_), cells_); };
  const int left = cell_of(x - reach_x);
  const int right = cell_of(x + reach_x);
  const int top = cell_of(y - reach_y);
  const int bottom = cell_of(y + reach_y);
  if (left == right && top == bottom) return false;
  const double first = cell(left, top);
  for (int row = top; row <= bottom; ++row) {
    for (int column = left; column <= right; ++column) {
      if (cell(column, row) != first) return true;
    }
  }
  return false;
}

bool BlurredPattern::is_white(double x, double y) const {
  return cell(std::min(floor_within(x, cells_), cells_), std::min(floor_within(y, cells_), cells_)) != 0;
}

}  // namespace hexcal
