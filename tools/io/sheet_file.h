#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "camera_calib/sheet.h"

namespace hexcal {

/// Reads a sheet.yaml strictly: one sheet, or several under `sheets:`. Ids and sizes have no defaults except
/// where the kind has none. Throws InputError naming file, line and key.
[[nodiscard]] std::vector<Sheet> read_sheet_file(const std::filesystem::path& path);

/// The text of a sheet.yaml that read_sheet_file reads back unchanged. `head` is the provenance line.
[[nodiscard]] std::string format_sheet_file(const std::string& head, const std::vector<Sheet>& sheets);

}  // namespace hexcal
