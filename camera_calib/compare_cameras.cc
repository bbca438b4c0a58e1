#include "camera_calib/compare_cameras.h"

#include <fmt/format.h>

#include <cmath>

#include "kinematics/geometry/input_error.h"

namespace hexcal {
namespace {

// Differences between honest calibrations share a few directions over the whole frame (f, c, k1 ..), so that
// their mean square scatters widely: this ratio is exceeded by chance about once in a hundred.
constexpr double kSignificantRatio = 2.5;

}  // namespace

CameraComparison compare_cameras(const CalibratedCamera& first, const CalibratedCamera& second) {
  if (first.model.width_px != second.model.width_px || first.model.height_px != second.model.height_px) {
    throw InputError(fmt::format(
        "cameras of {} x {} px and {} x {} px cannot be compared, wanted one image size",
        first.model.width_px, first.model.height_px, second.model.width_px, second.model.height_px));
  }
  CameraComparison out;
  out.difference = projection_difference(first.model, second.model);
  if (first.covariance.size() > 0 && second.covariance.size() > 0) {
    out.expected_rms_px =
        std::sqrt(projection_uncertainty(first.model, first.covariance).mean_variance_px2() +
                  projection_uncertainty(second.model, second.covariance).mean_variance_px2());
    out.significant = out.difference.rms_px > kSignificantRatio * out.expected_rms_px;
  }
  return out;
}

}  // namespace hexcal
