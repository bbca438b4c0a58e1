#include "tools/campaign/capture_groups.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "kinematics/geometry/input_error.h"
#include "photogrammetry/photograph/photograph.h"
#include "pose_extract/image_folders.h"

namespace hexcal {
namespace {

// EXIF's "2024:05:17 10:31:07" as seconds of a calendar without zones; none if it is not of that form.
std::optional<double> capture_seconds(const std::string& text) {
  int year = 0;
  unsigned month = 0;
  unsigned day = 0;
  int hour = 0;
  int minute = 0;
  double second = 0;
  if (std::sscanf(text.c_str(), "%4d:%2u:%2u %2d:%2d:%5lf", &year, &month, &day, &hour, &minute, &second) !=
      6) {
    return std::nullopt;
  }
  const auto day_of_year = std::chrono::year(year) / std::chrono::month(month) / std::chrono::day(day);
  const bool time_ok = hour >= 0 && hour < 24 && minute >= 0 && minute < 60 && second >= 0 && second < 61;
  if (year < 1900 || year > 9999 || month > 12 || day > 31 || !day_of_year.ok() || !time_ok)
    return std::nullopt;
  const std::chrono::sys_days date = day_of_year;
  return static_cast<double>(date.time_since_epoch().count()) * 86400 + hour * 3600 + minute * 60 + second;
}

}  // namespace

CaptureGroups group_by_capture_time(const std::filesystem::path& folder, double seconds) {
  if (!(seconds > 0)) throw InputError(fmt::format("--group-by-time: found {}, wanted more than 0", seconds));
  CaptureGroups groups;
  std::vector<std::pair<double, std::string>> taken;
  ListingOptions options;
  options.one_heap = true;
  const ImageListing heap = list_images(folder, options);
  groups.skipped = heap.skipped;
  for (const CampaignImage& image : heap.images) {
    const auto time = read_photograph_info(image.path).capture_time;
    if (!time) {
      groups.skipped.push_back({image.name, "has no capture time in its EXIF, which --group-by-time needs"});
    } else if (const auto at = capture_seconds(*time)) {
      taken.emplace_back(*at, image.name);
    } else {
      groups.skipped.push_back(
          {image.name, fmt::format("capture time '{}', wanted YYYY:MM:DD hh:mm:ss", *time)});
    }
  }
  std::sort(taken.begin(), taken.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first : natural_less(a.second, b.second);
  });
  int group = 0;
  for (std::size_t i = 0; i < taken.size(); ++i) {
    if (i == 0 || taken[i].first - taken[i - 1].first > seconds) ++group;
    groups.table.emplace_back(taken[i].second, fmt::format("g{:02d}", group));
  }
  return groups;
}

}  // namespace hexcal
