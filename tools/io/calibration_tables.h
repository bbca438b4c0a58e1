#pragma once

#include <string>
#include <vector>

#include "camera_calib/calibrate_camera.h"

namespace hexcal {

/// CSV of the sheets' poses: photograph, sheet, translation camera_from_sheet (x_mm ..), rotation vector
/// (rx_deg ..) and the sigmas of their perturbation (covariance.h), scaled by sigma0.
[[nodiscard]] std::string format_sheet_poses(const std::string& head,
                                             const std::vector<SheetPhotograph>& photographs,
                                             const CameraCalibration& calibration);

/// CSV of everything that went into a calibration, one feature a row: photograph, its SHA-256, sheet, name of
/// the first point, whether it was used, pixels, lower triangle of their covariance and residuals, each a
/// list with blanks between. The uncertainty can be computed again from it without the photographs.
[[nodiscard]] std::string format_calibration_inputs(const std::string& head, const std::vector<Sheet>& sheets,
                                                    const std::vector<SheetPhotograph>& photographs,
                                                    const CameraCalibration& calibration);

}  // namespace hexcal
