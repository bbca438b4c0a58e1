#pragma once

#include <string>

#include "camera_calib/calibrate_camera.h"
#include "camera_calib/camera_report.h"

namespace hexcal {

/// What a calibration shows on a terminal: photographs, models, parameters, quality, verdict.
[[nodiscard]] std::string camera_tables(const CameraCalibration& calibration, const CameraReport& report);

/// The same as JSON.
[[nodiscard]] std::string camera_json(const CameraCalibration& calibration, const CameraReport& report);

}  // namespace hexcal
