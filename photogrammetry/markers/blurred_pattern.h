#pragma once

#include <Eigen/Core>
#include <vector>

#include "photogrammetry/markers/marker.h"

namespace hexcal {

/// Symmetric 2x2 matrix: covariance of a point spread, or second derivatives.
struct Symmetric2 {
  double xx, xy, yy;
};

/// White share (0 black, 1 white) of a blurred pattern at a point, with first and second derivatives by the
/// point.
struct PatternSample {
  double value;
  double by_x, by_y;
  Symmetric2 second;
};

/// A pattern of square cells convolved with a Gaussian. Coordinates in cells, (0, 0) at the outer corner of
/// the top-left cell, x right, y down. A sum over the grid's lines and crossings in reach of univariate and
/// bivariate normal distribution functions: exact for any Gaussian, also where a steep view makes it oblique
/// to the cells. By the heat equation its derivative by the Gaussian's covariance is half the second
/// derivative.
class BlurredPattern {
 public:
  /// White beyond the grid.
  explicit BlurredPattern(const MarkerPattern& pattern);
  /// Four quadrants meeting at (1, 1), top left and bottom right white, as where squares of a chessboard
  /// meet.
  [[nodiscard]] static BlurredPattern saddle();
  /// The same where markers stand in the white squares, as on a ChArUco board. Its cells are as wide as the
  /// white gap around a marker, the quadrants meet at (2, 2), and from the second cell on, both ways, a white
  /// quadrant is black: the marker's border.
  [[nodiscard]] static BlurredPattern saddle_between_markers();

  [[nodiscard]] int cells() const { return cells_; }

  [[nodiscard]] PatternSample sample(double x, double y, const Symmetric2& blur) const;

  /// Whether the pattern changes within the box of half widths (reach_x, reach_y) around the point.
  [[nodiscard]] bool has_transition(double x, double y, double reach_x, double reach_y) const;

  /// Unblurred value.
  [[nodiscard]] bool is_white(double x, double y) const;

 private:
  BlurredPattern() = default;
  [[nodiscard]] double cell(int column, int row) const {
    return white_[static_cast<std::size_t>((row + 1) * (cells_ + 2) + column + 1)];
  }

  int cells_ = 0;
  std::vector<double> white_;  // (cells + 2)^2, with a ring around the grid
};

}  // namespace hexcal
