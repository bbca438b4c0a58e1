#pragma once

#include <Eigen/Core>
#include <vector>

#include "photogrammetry/markers/image_model.h"

namespace hexcal {

/// The least-squares problem of one marker's pixels about the parameters that are active: whitened residuals
/// and derivatives from the last evaluation, Huber weights (Huber 1964), priors.
class PixelEquations {
 public:
  using Matrix = Eigen::Matrix<double, kImageParameters, kImageParameters>;

  /// Of the active parameters, compressed to the first rows and columns.
  struct Normals {
    Matrix n;
    ImageVector rhs;
  };

  std::vector<FitPixel> pixels;
  std::vector<int> active;  ///< parameters, ascending
  ImageVector start = ImageVector::Zero();
  ImageVector prior_sigmas = ImageVector::Zero();  ///< about `start`; 0: none
  /// A saddle point's edges look the same when the pattern is stretched along them: that stretch is kept.
  bool affine = false;

  void evaluate(const ImageModel& model) { model.evaluate(pixels, active, residuals_, rows_); }

  /// Until the first scale is set nothing is an outlier.
  void forget_scale();
  void set_scale();  ///< the whitened residuals' median as a standard deviation, not below 1
  [[nodiscard]] double scale() const { return scale_; }

  [[nodiscard]] const std::vector<double>& residuals() const { return residuals_; }
  [[nodiscard]] const double* row(std::size_t pixel) const { return rows_.data() + pixel * active.size(); }
  [[nodiscard]] double weight(std::size_t pixel) const;
  /// Whether a pixel counts: not covered, and no clipped one that the model keeps beyond its bound.
  [[nodiscard]] bool tells(std::size_t pixel) const {
    return pixels[pixel].kept && (pixels[pixel].censored == 0 || residuals_[pixel] != 0);
  }

  [[nodiscard]] double cost(const ImageVector& parameters) const;
  [[nodiscard]] Normals normals() const;
  void add_priors(const ImageVector& parameters, Normals& normals) const;

  /// Drops cells (of a pattern of `cells` a side) whose pixels disagree with the model as a block: something
  /// covers them.
  void drop_covered_cells(int cells);

 private:
  std::vector<double> residuals_;
  std::vector<double> rows_;
  double scale_ = 0;
};

}  // namespace hexcal
