#pragma once

#include <vector>

#include "camera_calib/sheet_adjustment.h"

namespace hexcal {

/// What may vary in a fit: the lens model with its free terms, and the freedom of the sheets.
struct CameraVariant {
  LensModel lens = LensModel::brown;
  std::vector<char> free_parameters;  ///< per parameter; empty: all but the affinity
  BoardFreedom board = BoardFreedom::ideal;

  /// Of an adjustment of this variant, without covariances.
  [[nodiscard]] SheetAdjustmentOptions adjustment_options(double extra_sigma_px) const;
};

struct RobustFitOptions {
  /// A feature is an outlier if its chi^2 has a smaller probability than this (2 or 8 degrees of freedom),
  /// with the noise that the fit itself shows.
  double outlier_probability = 1e-6;
  int rounds = 3;  ///< of fit, noise estimate and test
  bool with_covariance = true;
  bool reject = true;  ///< else the start's rejections stay
};

struct RobustFitResult {
  SheetAdjustmentResult adjustment;
  double extra_sigma_px = 0;  ///< noise beside the measured covariances that brings sigma0 to 1
};

/// Adjusts, estimates the unexplained noise per coordinate (variance component, by the median in the first
/// rounds and by the mean in the last), rejects features beyond the test, and adjusts again.
[[nodiscard]] RobustFitResult robust_fit(const std::vector<Sheet>& sheets, const CalibrationState& start,
                                         const CameraVariant& variant, double start_sigma_px,
                                         const RobustFitOptions& options = {});

/// The same camera in another lens model: pinhole part kept, radial and decentring terms fitted to the old
/// ones over the frame where the models share no names.
[[nodiscard]] CameraModel converted_camera(const CameraModel& camera, LensModel lens);

/// From initial_state() to a Brown camera that fits to the noise: f and k1 first, then the rest, with falling
/// noise so that rough poses do not count as outliers.
[[nodiscard]] RobustFitResult first_fit(const std::vector<Sheet>& sheets, const CalibrationState& start);

}  // namespace hexcal
