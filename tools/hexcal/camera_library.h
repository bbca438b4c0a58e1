#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "camera_calib/calibrated_camera.h"

namespace hexcal {

/// A camera file of a library.
struct LibraryEntry {
  std::filesystem::path file;
  CalibratedCamera camera;
  std::string fault;  ///< why it cannot be read; empty if it can
};

/// The camera files of a folder, sorted by name. Throws InputError if it is no folder or holds none.
[[nodiscard]] std::vector<LibraryEntry> read_camera_library(const std::filesystem::path& folder);

[[nodiscard]] std::string camera_library_table(const std::vector<LibraryEntry>& entries);
[[nodiscard]] std::string camera_library_json(const std::vector<LibraryEntry>& entries);

}  // namespace hexcal
