#pragma once

#include <filesystem>
#include <string>

#include "photogrammetry/photograph/photograph.h"

namespace hexcal {

/// A photograph's file in memory, not decoded: opened and hashed once, whatever is then asked of it.
struct PhotographFile {
  std::filesystem::path path;
  PhotographStatus status = PhotographStatus::unreadable;  ///< ok: the file could be read
  std::string reason;                                      ///< why it could not
  std::string bytes;
  std::string sha256;  ///< of bytes; empty where status is not ok
};
[[nodiscard]] PhotographFile read_photograph_file(const std::filesystem::path& path);

/// As read_photograph of its path.
[[nodiscard]] Photograph decode_photograph(const PhotographFile& file);

/// As read_photograph_info of its path: EXIF and the size; nothing for a file that could not be read.
[[nodiscard]] PhotographInfo photograph_info(const PhotographFile& file);

}  // namespace hexcal
