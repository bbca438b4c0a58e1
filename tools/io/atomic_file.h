#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "photogrammetry/photograph/sha256.h"

namespace hexcal {

/// Whole file as bytes. Throws InputError naming the file if it cannot be read.
[[nodiscard]] std::string read_file(const std::filesystem::path& path);

/// Writes to a temporary name in the same folder, flushes it to the disk and renames it, so that an
/// interrupted run leaves the old file or the new, never half. Creates missing parent folders. Throws
/// InputError with the system's reason (permission, no space left, ...) and then leaves the old file
/// untouched.
void write_file_atomically(const std::filesystem::path& path, std::string_view contents);

/// First comment line of every output: "# hexcal VERSION  COMMAND  NAME sha256:HASH ...". Inputs that do not
/// exist are left out; names are printed without their folders so that the line does not depend on where the
/// campaign lies.
[[nodiscard]] std::string provenance_line(std::string_view version, std::string_view command,
                                          const std::vector<std::filesystem::path>& inputs);

}  // namespace hexcal
