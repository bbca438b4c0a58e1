#pragma once

#include <filesystem>
#include <vector>

#include "camera_calib/calibrate_camera.h"
#include "camera_calib/camera_report.h"

namespace hexcal {

/// The photographs named on the command line: files as given, folders replaced by the photographs in them,
/// sorted. Throws InputError for a path that does not exist or a folder without photographs.
[[nodiscard]] std::vector<std::filesystem::path> photograph_paths(
    const std::vector<std::filesystem::path>& given);

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
                                            const CalibrateOptions& options);

}  // namespace hexcal
