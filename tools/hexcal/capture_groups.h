#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace hexcal {

/// (file, pose) for the photographs of one flat folder, poses `g01`, `g02`, ... in the order of capture: a
/// pause longer than `seconds` begins a new pose. Throws InputError naming a photograph without a capture
/// time.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> group_by_capture_time(
    const std::filesystem::path& folder, double seconds);

}  // namespace hexcal
