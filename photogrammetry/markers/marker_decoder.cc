#include "photogrammetry/markers/marker_decoder.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

#include "photogrammetry/markers/fit_pixels.h"
#include "photogrammetry/markers/printed_pattern.h"

namespace hexcal {
namespace {

constexpr double kMaxChanceHits = 2e-3;  // of random cells within an intact border
constexpr double kMinContrast = 10;      // encoded 8-bit values
constexpr double kMinClarity = 0.45;
constexpr double kMaxWrongBorder = 0.15;  // share of the cells that are the same in all patterns
constexpr double kSharpenBelowPx = 4;     // a cell this small mixes with its neighbours

// Where the cell (x, y) of the upright pattern is after `turns` quarter turns of the reading, or mirrored
// first.
int turned_cell(int cell, int cells, int turns, bool mirrored) {
  int x = cell % cells;
  int y = cell / cells;
  if (mirrored) x = cells - 1 - x;
  for (int i = 0; i < turns; ++i) {
    const int old = x;
    x = cells - 1 - y;
    y = old;
  }
  return y * cells + x;
}

// Value = (1, x, y) plane, by least squares.
struct Plane {
  Eigen::Vector3d coefficients = Eigen::Vector3d::Zero();
  [[nodiscard]] double at(double x, double y) const { return coefficients.dot(Eigen::Vector3d(1, x, y)); }
};

class PlaneFit {
 public:
  void add(double x, double y, double value) {
    const Eigen::Vector3d row(1, x, y);
    n_ += row * row.transpose();
    rhs_ += row * value;
  }
  [[nodiscard]] Plane solve() const {
    Eigen::Matrix3d n = n_;
    n.diagonal().tail<2>().array() += 1;  // few cells: level
    return {n.ldlt().solve(rhs_)};
  }

 private:
  Eigen::Matrix3d n_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d rhs_ = Eigen::Vector3d::Zero();
};

double bilinear(const cv::Mat& grey, const Eigen::Vector2d& px) {
  const double x = std::clamp(px.x(), 0.0, grey.cols - 1.001);
  const double y = std::clamp(px.y(), 0.0, grey.rows - 1.001);
  const int ix = static_cast<int>(x);
  const int iy = static_cast<int>(y);
  const double sx = x - ix;
  const double sy = y - iy;
  const std::uint8_t* row = grey.ptr(iy) + ix;
  const std::uint8_t* below = grey.ptr(iy + 1) + ix;
  return (row[0] * (1 - sx) + row[1] * sx) * (1 - sy) + (below[0] * (1 - sx) + below[1] * sx) * sy;
}

int smallest_distance(const std::vector<std::uint64_t>& words,
                      const std::vector<std::array<std::uint64_t, 4>>& turned) {
  int least = 64;
  for (std::size_t i = 0; i < words.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      for (const std::uint64_t other : turned[j]) least = std::min(least, std::popcount(words[i] ^ other));
    }
    for (int turns = 1; turns < 4; ++turns) {
      least = std::min(least, std::popcount(words[i] ^ turned[i][static_cast<std::size_t>(turns)]));
    }
  }
  return least;
}

double chance_hits(std::size_t codes, std::size_t bits, int wrong) {
  double ways = 0;
  double choose = 1;
  for (int k = 0; k <= wrong; ++k) {
    ways += choose;
    choose *= (static_cast<double>(bits) - k) / (k + 1);
  }
  return 4 * static_cast<double>(codes) * ways * std::pow(0.5, static_cast<double>(bits));
}

}  // namespace

MarkerDecoder::MarkerDecoder(const MarkerFamily& family, const std::vector<int>& ids) {
  cells_ = family.patterns.front().cells;
  square_cells_ = family.patterns.front().square_cells;
  const int count = cells_ * cells_;
  std::vector<bool> differs(static_cast<std::size_t>(count), false);
  for (int cell = 0; cell < count; ++cell) {
    const auto k = static_cast<std::size_t>(cell);
    for (const auto& pattern : family.patterns) {
      if (pattern.white[k] == family.patterns.front().white[k]) continue;
      for (int turns = 0; turns < 4; ++turns) {
        for (const bool mirrored : {false, true}) {
          differs[static_cast<std::size_t>(turned_cell(cell, cells_, turns, mirrored))] = true;
        }
      }
      break;
    }
  }
  for (int cell = 0; cell < count; ++cell) {
    const auto k = static_cast<std::size_t>(cell);
    if (differs[k]) {
      data_cells_.push_back(cell);
    } else {
      (family.patterns.front().white[k] != 0 ? white_cells_ : black_cells_).push_back(cell);
    }
  }
  assert(data_cells_.size() <= 64);
  const auto word_of = [&](const MarkerPattern& pattern, int turns) {
    std::uint64_t word = 0;
    for (const int cell : data_cells_) {
      word = word << 1 | pattern.white[static_cast<std::size_t>(turned_cell(cell, cells_, turns, false))];
    }
    return word;
  };
  std::vector<std::uint64_t> words;
  std::vector<std::array<std::uint64_t, 4>> turned;
  for (const auto& pattern : family.patterns) {
    words.push_back(word_of(pattern, 0));
    turned.push_back({words.back(), word_of(pattern, 1), word_of(pattern, 2), word_of(pattern, 3)});
  }
  for (std::size_t id = 0; id < words.size(); ++id) {
    const int number = static_cast<int>(id);
    if (same_when_turned(family.patterns[id])) continue;
    if (ids.empty() || std::find(ids.begin(), ids.end(), number) != ids.end())
      codes_.push_back({words[id], number});
  }
  // Families of 60 000 codes are too large to compare all pairs; those state their distance.
  const int distance = family.distance > 0 ? family.distance : smallest_distance(words, turned);
  max_wrong_ = std::max((distance - 1) / 2, 0);
  while (max_wrong_ > 0 && chance_hits(codes_.size(), data_cells_.size(), max_wrong_) > kMaxChanceHits)
    --max_wrong_;
}

std::optional<DecodedMarker> MarkerDecoder::decode(const cv::Mat& grey, const Quad& quad) const {
  // Homography of the square to pixels.
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const auto& corner : quad.corners_px) middle += 0.25 * corner;
  double side = 0;
  for (std::size_t i = 0; i < 4; ++i)
    side += 0.25 * (quad.corners_px[(i + 1) % 4] - quad.corners_px[i]).norm();
  std::array<Eigen::Vector2d, 4> scaled;
  for (std::size_t i = 0; i < 4; ++i) scaled[i] = (quad.corners_px[i] - middle) / side;
  const auto g = homography_from_corners(scaled);
  if (!g) return std::nullopt;
  Eigen::Matrix3d forward;
  forward << (*g)[0], (*g)[1], (*g)[2], (*g)[3], (*g)[4], (*g)[5], (*g)[6], (*g)[7], 1;
  forward = forward.inverse().eval();
  const auto px_of = [&](double x, double y) -> Eigen::Vector2d {
    const double t = 2 / square_cells_;
    const Eigen::Vector3d n = forward * Eigen::Vector3d((x - 0.5 * cells_) * t, (y - 0.5 * cells_) * t, 1);
    return middle + side * n.hnormalized();
  };

  const int count = cells_ * cells_;
  std::vector<double> values(static_cast<std::size_t>(count));
  const double cell_px = side / square_cells_;
  const double spread = cell_px > 6 ? 0.2 : 0;
  for (int cell = 0; cell < count; ++cell) {
    const double x = cell % cells_ + 0.5;
    const double y = cell / cells_ + 0.5;
    double value = bilinear(grey, px_of(x, y));
    if (spread > 0) {
      for (const double d : {-spread, spread}) {
        value += bilinear(grey, px_of(x + d, y)) + bilinear(grey, px_of(x, y + d));
      }
      value /= 5;
    }
    values[static_cast<std::size_t>(cell)] = value;
  }

  PlaneFit black_fit;
  PlaneFit white_fit;
  for (const int cell : black_cells_) {
    black_fit.add(cell % cells_ - 0.5 * cells_ + 0.5, cell / cells_ - 0.5 * cells_ + 0.5,
                  values[static_cast<std::size_t>(cell)]);
  }
  for (const int cell : white_cells_) {
    white_fit.add(cell % cells_ - 0.5 * cells_ + 0.5, cell / cells_ - 0.5 * cells_ + 0.5,
                  values[static_cast<std::size_t>(cell)]);
  }
  const bool border_on_paper = white_cells_.size() < 4;
  if (border_on_paper) {  // half a cell of paper is all there need be
    const double beyond = std::max(0.4, std::min(0.5, 1.0 / cell_px));
    for (int i = 0; i < cells_; ++i) {
      const double at = i + 0.5;
      const double far = cells_ + beyond;
      const double positions[4][2] = {{at, -beyond}, {at, far}, {-beyond, at}, {far, at}};
      for (const auto& p : positions) {
        white_fit.add(p[0] - 0.5 * cells_, p[1] - 0.5 * cells_, bilinear(grey, px_of(p[0], p[1])));
      }
    }
  }
  const Plane black = black_fit.solve();
  const Plane white = white_fit.solve();
  DecodedMarker marker;
  const double contrast = white.at(0, 0) - black.at(0, 0);
  if (std::abs(contrast) < kMinContrast) return std::nullopt;
  marker.inverted = contrast < 0;

  // Cells in half contrasts about the threshold, white positive.
  std::vector<double> relative(values.size());
  for (int cell = 0; cell < count; ++cell) {
    const double x = cell % cells_ - 0.5 * cells_ + 0.5;
    const double y = cell / cells_ - 0.5 * cells_ + 0.5;
    const double half = 0.5 * (white.at(x, y) - black.at(x, y));
    const double threshold = 0.5 * (white.at(x, y) + black.at(x, y));
    const auto k = static_cast<std::size_t>(cell);
    relative[k] = std::abs(half) < 1 ? 0 : (values[k] - threshold) / half;
  }
  if (cell_px < kSharpenBelowPx) {
    // Blur mixes each cell with its neighbours: take a part of them off again.
    const std::vector<double> blurred = relative;
    const double strength = std::min(0.35, 1.2 / (cell_px * cell_px));
    const auto at = [&](int x, int y) {
      if (x < 0 || y < 0 || x >= cells_ || y >= cells_) return 1.0;
      return blurred[static_cast<std::size_t>(y * cells_ + x)];
    };
    for (int y = 0; y < cells_; ++y) {
      for (int x = 0; x < cells_; ++x) {
        relative[static_cast<std::size_t>(y * cells_ + x)] +=
            strength * (4 * at(x, y) - at(x - 1, y) - at(x + 1, y) - at(x, y - 1) - at(x, y + 1));
      }
    }
  }

  int wrong_border = 0;
  double border_clarity = 0;
  for (const int cell : black_cells_) {
    const double value = -relative[static_cast<std::size_t>(cell)];
    wrong_border += value < 0 ? 1 : 0;
    border_clarity += std::clamp(value, -1.0, 1.0);
  }
  for (const int cell : white_cells_) {
    const double value = relative[static_cast<std::size_t>(cell)];
    wrong_border += value < 0 ? 1 : 0;
    border_clarity += std::clamp(value, -1.0, 1.0);
  }
  const auto fixed = static_cast<double>(black_cells_.size() + white_cells_.size());
  if (wrong_border > kMaxWrongBorder * fixed) return std::nullopt;

  int best_wrong = max_wrong_ + 1;
  int best_turns = 0;
  for (const bool mirrored : {false, true}) {
    for (int turns = 0; turns < 4; ++turns) {
      std::uint64_t word = 0;
      for (const int cell : data_cells_) {
        const int place = turned_cell(cell, cells_, turns, mirrored);
        word = word << 1 | (relative[static_cast<std::size_t>(place)] > 0 ? 1U : 0U);
      }
      for (const Code& code : codes_) {
        const int wrong = std::popcount(word ^ code.word);
        if (wrong >= best_wrong) continue;
        best_wrong = wrong;
        best_turns = turns;
        marker.id = code.id;
        marker.mirrored = mirrored;
        marker.wrong_cells = wrong;
        double clarity = border_clarity;
        for (std::size_t k = 0; k < data_cells_.size(); ++k) {
          const int place = turned_cell(data_cells_[k], cells_, turns, mirrored);
          const bool is_white = (code.word >> (data_cells_.size() - 1 - k) & 1U) != 0;
          const double value = relative[static_cast<std::size_t>(place)] * (is_white ? 1 : -1);
          clarity += std::clamp(value, -1.0, 1.0);
        }
        marker.clarity = clarity / count;
      }
    }
  }
  if (marker.id < 0 || marker.clarity < kMinClarity) return std::nullopt;
  // Corner k of the upright marker is where its corner cell was read.
  static constexpr int kCornerX[4] = {0, 1, 1, 0};
  static constexpr int kCornerY[4] = {0, 0, 1, 1};
  for (int k = 0; k < 4; ++k) {
    const int cell = (cells_ - 1) * (kCornerY[k] * cells_ + kCornerX[k]);
    const int place = turned_cell(cell, cells_, best_turns, marker.mirrored);
    const bool right = place % cells_ > 0;
    const bool bottom = place / cells_ > 0;
    const std::size_t index = right ? (bottom ? 2U : 1U) : (bottom ? 3U : 0U);
    marker.corners_px[static_cast<std::size_t>(k)] = quad.corners_px[index];
  }
  return marker;
}

}  // namespace hexcal
