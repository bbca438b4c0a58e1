#pragma once

#include <filesystem>
#include <string>

#include "calibration/calibration_model.h"

namespace hexcal {

/// Text of model.yaml; `head` holds its comment lines. Keys: `method`; `nominal` and, for kinematic,
/// `machine`, both as in hexapod.yaml; where they are not zero `stroke_curves` (per leg low, high in actuator
/// units and coefficients_mm), `sag`, `backlash_mm`; for option1 to option3 `pose_lines` (six times intercept
/// in mm or rad and slope) and `joint_lines` (six legs of twelve numbers).
[[nodiscard]] std::string model_text(const std::string& head, const CalibrationModel& model);

/// Reads model.yaml strictly. Throws InputError naming file, line and key.
[[nodiscard]] CalibrationModel read_model_file(const std::filesystem::path& path);
[[nodiscard]] CalibrationModel parse_model(const std::string& text, const std::filesystem::path& path);

}  // namespace hexcal
