#pragma once

#include <filesystem>
#include <string>

#include "camera_calib/calibrated_camera.h"

namespace hexcal {

/// Reads a camera.yaml:
///
///     model: brown                     # brown, rational, radial (camera_model.h)
///     image_size_px: [6016, 4000]
///     parameters: {f_px: 9011.1, affinity: 0, cx_px: 3007.5, cy_px: 1999.5, k1: ..., ...}  # all of them
///     valid_radius: 0.46               # optional: tan of the largest ray angle the model was fitted for
///     covariance: [[...], ...]         # optional, n x n in the order of the parameters
///     setting: {make: ..., ...}        # optional
///     quality: {...}                   # optional
///
/// Refuses (InputError) unknown or missing keys, a covariance that is not symmetric or not positive, a model
/// that folds inside the frame, a principal point outside it.
[[nodiscard]] CalibratedCamera read_camera_file(const std::filesystem::path& path);

/// The text of a camera.yaml; read_camera_file gives back the same doubles. `head` is the provenance line.
[[nodiscard]] std::string format_camera_file(const std::string& head, const CalibratedCamera& camera);

}  // namespace hexcal
