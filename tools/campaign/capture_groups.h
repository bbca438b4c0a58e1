#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "pose_extract/image_folders.h"

namespace hexcal {

struct CaptureGroups {
  std::vector<std::pair<std::string, std::string>> table;  ///< (file, pose) as ListingOptions has it
  std::vector<SkippedFile> skipped;                        ///< photographs without a capture time
};

/// Groups the photographs below a folder (a memory card) into poses g01, g02, ... wherever the pause between
/// two exposures is longer than `seconds`. Throws InputError if the folder does not exist.
[[nodiscard]] CaptureGroups group_by_capture_time(const std::filesystem::path& folder, double seconds);

}  // namespace hexcal
