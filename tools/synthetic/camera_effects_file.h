#pragma once

#include <string>

#include "tools/io/yaml_map.h"
#include "tools/synthetic/camera_effects.h"

namespace hexcal {

/// `ideal`, `d3200`, or the path of a YAML file: groups print, platform, lens, sensor and processing with the
/// fields of CameraEffects; the key `preset` names what the file starts from (default ideal). Throws
/// InputError.
[[nodiscard]] CameraEffects read_camera_effects(const std::string& name_or_file);

/// The same from a mapping; calls finish().
[[nodiscard]] CameraEffects camera_effects_of(const YamlMap& map);

/// All groups and keys, as read_camera_effects reads them; every line begins with `indent`.
[[nodiscard]] std::string format_camera_effects(const CameraEffects& effects, const std::string& indent = "");

}  // namespace hexcal
