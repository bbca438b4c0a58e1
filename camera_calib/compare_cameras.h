#pragma once

#include "camera_calib/calibrated_camera.h"
#include "camera_calib/projection_difference.h"

namespace hexcal {

/// Two calibrations of one setting side by side.
struct CameraComparison {
  ProjectionDifference difference;
  double expected_rms_px = 0;  ///< of the difference, from both covariances; 0 if either is unknown
  /// The difference is more than 2.5 times what the covariances lead to expect over the frame.
  bool significant = false;
};

/// Throws InputError if the cameras' image sizes differ.
[[nodiscard]] CameraComparison compare_cameras(const CalibratedCamera& first, const CalibratedCamera& second);

}  // namespace hexcal
