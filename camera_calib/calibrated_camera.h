#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "camera_calib/lens_setting.h"
#include "photogrammetry/camera/camera_model.h"

namespace hexcal {

enum class CameraVerdict { unknown, good, usable, retake };

[[nodiscard]] const char* camera_verdict_name(CameraVerdict verdict);

/// Figures of the calibration that made a camera; zero where unknown.
struct CameraQuality {
  CameraVerdict verdict = CameraVerdict::unknown;
  double rms_px = 0;                 ///< sqrt of the mean squared residual vector over the points used
  double sigma0 = 0;                 ///< of the whitened residuals; 1 if the corners' covariances are right
  int photographs = 0;               ///< used
  int points = 0;                    ///< used
  double uncertainty_centre_px = 0;  ///< sigma of projection, worst axis, after the best rotation
  double uncertainty_corner_px = 0;  ///< worst corner of the frame
  double cross_validation_px = 0;    ///< rms difference between the halves over the frame
  double coverage_percent = 0;       ///< of the frame's cells that hold points
};

/// A camera as its file holds it.
struct CalibratedCamera {
  CameraModel model;
  /// Covariance of model.parameters (n x n), scaled by sigma0; rows of parameters held fixed are zero. Empty
  /// if unknown.
  Eigen::MatrixXd covariance;
  LensSetting setting;
  CameraQuality quality;
};

}  // namespace hexcal
