#pragma once

#include <filesystem>
#include <string>

#include "kinematics/platform.h"

namespace hexcal {

class YamlMap;

/// Reads hexapod.yaml (units mm and deg, keys as hexapod_text writes them). Throws InputError naming file,
/// line and key; a geometry that no machine can have is refused with the reason.
[[nodiscard]] PlatformGeometry read_hexapod_file(const std::filesystem::path& path);

/// The same from text; `path` is used in messages only.
[[nodiscard]] PlatformGeometry parse_hexapod(const std::string& text, const std::filesystem::path& path);

/// The same from an open mapping, whose keys must all be known.
[[nodiscard]] PlatformGeometry hexapod_from_yaml(const YamlMap& map);

/// Text of a hexapod.yaml; `head` holds its comment lines, each with its line break. Numbers are written with
/// all their digits.
[[nodiscard]] std::string hexapod_text(const std::string& head, const PlatformGeometry& geometry);

}  // namespace hexcal
