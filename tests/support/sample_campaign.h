#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace hexcal {

/// Copies the sample campaign's files and the photographs of some of its poses (needs HEXCAL_SOURCE).
inline void copy_sample_campaign(const std::filesystem::path& to,
                                 const std::vector<std::string>& poses = {}) {
  namespace fs = std::filesystem;
  const fs::path sample = fs::path(HEXCAL_SOURCE) / "samples" / "small_lab";
  fs::create_directories(to / "poses");
  for (const fs::directory_entry& entry : fs::directory_iterator(sample))
    if (entry.is_regular_file()) fs::copy(entry.path(), to / entry.path().filename());
  for (const std::string& pose : poses)
    fs::copy(sample / "poses" / pose, to / "poses" / pose, fs::copy_options::recursive);
}

}  // namespace hexcal
