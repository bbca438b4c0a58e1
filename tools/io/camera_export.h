#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "camera_calib/calibrated_camera.h"

namespace hexcal {

/// Names that `export --to` takes for a camera: opencv, ros, kalibr, colmap, mrcal.
[[nodiscard]] const std::vector<std::string>& camera_export_formats();

/// A camera in another program's format.
struct CameraExport {
  std::string text;
  std::string model;  ///< the target's model, for instance FULL_OPENCV
  double rms_px = 0;  ///< over the frame, from the camera that was exported; zero where the model is the same
  double max_px = 0;
};

/// The richest model of the format that is needed; richer cameras are fitted to it. Pixel (0, 0) is moved to
/// the format's own origin (COLMAP: half a pixel). Throws InputError for an unknown format.
[[nodiscard]] CameraExport export_camera(const CalibratedCamera& camera, const std::string& format);

/// Reads a camera of another program: OpenCV's calibration YAML, ROS camera_info, or PhotoModeler's values as
///     photomodeler: {focal_mm: .., principal_point_mm: [..], format_mm: [..], k: [k1, k2, k3], p: [p1, p2]}
///     image_size_px: [..]
/// PhotoModeler corrects measured to ideal (x + dx, mm, y up); a Brown camera is fitted to that, its error in
/// `fit_rms_px`. Throws InputError naming file and key.
struct ForeignCamera {
  CalibratedCamera camera;
  std::string format;
  double fit_rms_px = 0;
};
[[nodiscard]] ForeignCamera read_foreign_camera(const std::filesystem::path& path);

}  // namespace hexcal
