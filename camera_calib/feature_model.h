#pragma once

#include <vector>

#include "camera_calib/sheet_adjustment.h"

namespace hexcal {

/// Whitened residuals of one feature and their derivatives. Parameter blocks: camera parameters (n), pose
/// camera_from_sheet as rotation vector and translation (6), deformation of the sheet (5), shifts of the
/// feature's points (3 each).
class FeatureModel {
 public:
  FeatureModel(const CameraModel& camera, const FeatureObservation& feature,
               std::vector<Eigen::Vector3d> drawn_mm, const Eigen::Vector2d& half_extent_mm,
               double extra_sigma_px);

  /// Residuals (2 per point) and, where not null, row-major Jacobians per block; false behind the camera.
  bool evaluate(double const* const* parameters, double* residuals, double** jacobians) const;

  /// Unwhitened residual, measured minus model; false behind the camera.
  bool residual_px(double const* const* parameters, FeatureObservation::Vector& out) const;

  [[nodiscard]] int residuals() const { return static_cast<int>(px_.size()); }
  [[nodiscard]] std::vector<int> block_sizes() const;

 private:
  CameraModel camera_;  // size and kind; its parameters are those of the first block
  FeatureObservation::Vector px_;
  FeatureObservation::Matrix whitening_;
  std::vector<Eigen::Vector3d> drawn_mm_;
  Eigen::Vector2d half_extent_mm_;
};

}  // namespace hexcal
