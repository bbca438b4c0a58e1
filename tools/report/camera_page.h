#pragma once

#include <string>
#include <vector>

#include "camera_calib/camera_report.h"

namespace hexcal {

/// A calibration as one self-contained HTML page: verdict, coverage and residuals over the frame, uncertainty
/// map, radial profile, photograph by photograph, models tried. `camera_file` is named only.
[[nodiscard]] std::string render_camera_page(const std::vector<Sheet>& sheets,
                                             const CameraCalibration& calibration,
                                             const std::string& camera_file, const LensSetting& setting,
                                             const CameraReport& report);

}  // namespace hexcal
