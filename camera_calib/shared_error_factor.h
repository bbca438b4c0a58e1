#pragma once

#include <functional>
#include <vector>

#include "camera_calib/shared_errors.h"
#include "camera_calib/sheet_observation.h"
#include "photogrammetry/camera/camera_model.h"

namespace hexcal {

/// A feature of the adjustment; its rows in the system are 2 per point, in the order of the features.
struct UsedFeature {
  int photograph = 0;
  int sheet = 0;
  const FeatureObservation* feature = nullptr;
};

/// By how much the camera is less certain than independent noise would leave it, as standard deviations of
/// projection over the frame (root mean square); 1 where there are too few to tell.
struct SharedErrorFactors {
  double photographs = 1;  ///< errors common to a photograph: a sheet that bends anew, blur by motion
  double places = 1;       ///< common to a place in the frame: a lens model that is not adequate
  double points = 1;       ///< common to a printed point: a sheet that differs from its model

  /// The largest, at least 1: by this the camera's sigmas are widened.
  [[nodiscard]] double largest() const;
};

/// Of the camera in the middle of an adjustment. `camera_part` takes the covariance of the camera's
/// parameters out of that of the shared unknowns; `variance` of the whitened residuals scales that of
/// independent noise.
[[nodiscard]] SharedErrorFactors shared_error_factors(
    const ReducedSystem& system, const std::vector<UsedFeature>& used, const CameraModel& camera,
    const std::function<Eigen::MatrixXd(const Eigen::MatrixXd&)>& camera_part, double variance);

/// Whitened squared residuals per photograph, in the order of its first feature, by the camera that the
/// others give. Empty with fewer than two.
[[nodiscard]] std::vector<double> left_out_chi2(const ReducedSystem& system,
                                                const std::vector<UsedFeature>& used);

}  // namespace hexcal
