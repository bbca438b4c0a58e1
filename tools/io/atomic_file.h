#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "photogrammetry/photograph/sha256.h"

namespace hexcal {

/// Whole file as bytes. Throws InputError naming the file if it cannot be read.
[[nodiscard]] std::string read_file(const std::filesystem::path& path);

/// Whether a file must survive a power cut, or may be lost then because it can be made anew.
enum class Keep { always, unless_power_fails };

/// Writes to a temporary name in the same folder, flushes it to the disk and renames it, so that an
/// interrupted run leaves the old file or the new, never half. Creates missing parent folders. Throws
/// InputError with the system's reason (permission, no space left, ...) and then leaves the old file
/// untouched.
void write_file_atomically(const std::filesystem::path& path, std::string_view contents,
                           Keep keep = Keep::always);

/// The same for files that belong together: all are written and flushed before the first is renamed, so that
/// a full disk leaves every old file as it was.
void write_files_atomically(const std::vector<std::pair<std::filesystem::path, std::string>>& files);

/// Takes away what writers whose process is gone left behind in a folder.
void remove_abandoned_files(const std::filesystem::path& folder);

/// First comment line of every output: "# hexcal VERSION  COMMAND  NAME sha256:HASH ...". Inputs that do not
/// exist are left out; names are printed without their folders so that the line does not depend on where the
/// campaign lies.
[[nodiscard]] std::string provenance_line(std::string_view version, std::string_view command,
                                          const std::vector<std::filesystem::path>& inputs);

}  // namespace hexcal
