#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "camera_calib/calibrate_camera.h"
#include "camera_calib/lens_setting.h"

namespace hexcal {

/// What reading, detecting and calibrating gave.
struct MeasuredCamera {
  std::vector<SheetPhotograph> photographs;
  CameraCalibration calibration;
  LensSetting setting;  ///< of the photographs that were used
};

/// Reads and measures all photographs, calibrates roughly, measures again with the lens in the photometric
/// model, and calibrates. Photographs of another size than most, or of another focal length by their EXIF,
/// are left out with their reason.
[[nodiscard]] MeasuredCamera measure_camera(const std::vector<std::filesystem::path>& paths,
                                            const std::vector<Sheet>& sheets,
                                            const CameraCalibrationOptions& options = {},
                                            const std::function<void()>& on_photograph = {});

}  // namespace hexcal
