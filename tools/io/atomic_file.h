#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "photogrammetry/photograph/input_file.h"
#include "photogrammetry/photograph/sha256.h"

namespace hexcal {

/// Whole file as bytes. Throws InputError naming the file if it is no regular file (see input_file.h), cannot
/// be read or holds more than 1 GiB. A pipe that a shell hands over is read to its end, 64 MiB at most; asked
/// for again it gives the same bytes.
[[nodiscard]] std::string read_file(const std::filesystem::path& path, ReadFor purpose = ReadFor::input);

/// Whether a file must survive a power cut, or may be lost then because it can be made anew.
enum class Keep { always, unless_power_fails };

/// Writes to a temporary name in the same folder, flushes it to the disk and renames it, so that an
/// interrupted run leaves the old file or the new, never half (output_file.h, also for what it may replace).
/// Creates missing parent folders. Throws InputError with the system's reason (permission, no space left,
/// ...) and then leaves the old file untouched.
void write_file_atomically(const std::filesystem::path& path, std::string_view contents,
                           Keep keep = Keep::always);

/// The same for files that belong together: all are written and flushed before the first is renamed, so that
/// a full disk leaves every old file as it was. Throws if two of them have one name.
void write_files_atomically(const std::vector<std::pair<std::filesystem::path, std::string>>& files);

/// A results folder is hexcal's own: throws InputError if it, or a folder in it, is a link to somewhere else.
/// (A file that is a link is no danger: it is replaced, not written through.)
void refuse_linked_folders(const std::filesystem::path& results);

/// Takes away what writers whose process is gone left behind in a folder, of all files or of one.
void remove_abandoned_files(const std::filesystem::path& folder, std::string_view of_file = {});

/// First comment line of every output: "# hexcal VERSION  COMMAND  NAME sha256:HASH ...". Inputs that do not
/// exist are left out; names are printed without their folders so that the line does not depend on where the
/// campaign lies.
[[nodiscard]] std::string provenance_line(std::string_view version, std::string_view command,
                                          const std::vector<std::filesystem::path>& inputs);

}  // namespace hexcal
