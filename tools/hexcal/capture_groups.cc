#include "tools/hexcal/capture_groups.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "kinematics/geometry/input_error.h"
#include "photogrammetry/photograph/photograph.h"
#include "pose_extract/image_folders.h"

namespace hexcal {
namespace {

// EXIF's "2024:05:17 10:31:07" as seconds of a calendar without zones.
double capture_seconds(const std::string& text, const std::filesystem::path& path) {
  int year = 0;
  unsigned month = 0;
  unsigned day = 0;
  int hour = 0;
  int minute = 0;
  double second = 0;
  if (std::sscanf(text.c_str(), "%d:%u:%u %d:%d:%lf", &year, &month, &day, &hour, &minute, &second) != 6) {
    throw InputError(fmt::format("{}: capture time '{}', wanted YYYY:MM:DD hh:mm:ss", path.string(), text));
  }
  const std::chrono::sys_days date =
      std::chrono::year(year) / std::chrono::month(month) / std::chrono::day(day);
  return static_cast<double>(date.time_since_epoch().count()) * 86400 + hour * 3600 + minute * 60 + second;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> group_by_capture_time(const std::filesystem::path& folder,
                                                                       double seconds) {
  if (!(seconds > 0)) throw InputError(fmt::format("--group-by-time: found {}, wanted more than 0", seconds));
  if (!std::filesystem::is_directory(folder))
    throw InputError(fmt::format("{}: no such folder", folder.string()));
  std::vector<std::pair<double, std::string>> taken;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (!entry.is_regular_file() || !is_photograph_name(entry.path())) continue;
    const auto time = read_photograph_info(entry.path()).capture_time;
    if (!time) {
      throw InputError(fmt::format("{}: has no capture time in its EXIF, wanted by --group-by-time",
                                   entry.path().string()));
    }
    taken.emplace_back(capture_seconds(*time, entry.path()), entry.path().filename().string());
  }
  std::sort(taken.begin(), taken.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first : natural_less(a.second, b.second);
  });
  std::vector<std::pair<std::string, std::string>> table;
  int group = 0;
  for (std::size_t i = 0; i < taken.size(); ++i) {
    if (i == 0 || taken[i].first - taken[i - 1].first > seconds) ++group;
    table.emplace_back(taken[i].second, fmt::format("g{:02d}", group));
  }
  return table;
}

}  // namespace hexcal
