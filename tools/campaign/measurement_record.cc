#include "tools/campaign/measurement_record.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>

#include "kinematics/geometry/input_error.h"
#include "photogrammetry/photograph/sha256.h"
#include "tools/io/atomic_file.h"
#include "tools/io/json_text.h"
#include "tools/io/kept_text.h"

namespace hexcal {
namespace fs = std::filesystem;
namespace {

using FileHash = std::pair<std::string, std::string>;  // path, SHA-256

fs::path record_file(const OpenCampaign& open) { return open.results / "cache" / "measurement.json"; }

// Everything but the content of files: flags and listing.
std::string circumstances(const MeasureRequest& request, const OpenCampaign& open) {
  std::string text = fmt::format("{} {} {} {} {} {} {} {} {} {}\n", request.campaign.string(),
                                 request.poses_dir.value_or("").string(), open.poses_csv.string(),
                                 request.observations.value_or("").string(), request.home.value_or(""),
                                 request.group_by_time_s.value_or(-1), request.interior_fixed,
                                 request.overlays, request.colmap, request.map_poses);
  if (request.observations) return sha256_hex(text);
  const ImageListing& listing = open.listing;
  for (const std::string& pose : listing.poses) text += fmt::format("{}\n", pose);
  for (const CampaignImage& image : listing.images) {
    text += fmt::format("{} {} {} {}\n", image.name, image.pose, image.path.string(), image.folder);
  }
  for (const SkippedFile& file : listing.skipped) text += fmt::format("{}: {}\n", file.name, file.reason);
  return sha256_hex(text);
}

// SHA-256 of a file's content; empty if it cannot be read (whoever needs the content says why).
std::string hash_if_readable(const fs::path& path, ReadFor purpose) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return {};
  try {
    return sha256_hex(read_file(path, purpose));
  } catch (const InputError&) {  // no right to read it, or it is gone since
    return {};
  }
}

// The program itself and all that open_campaign and the judging of a measurement read.
std::vector<fs::path> files_read(const MeasureRequest& request, const OpenCampaign& open) {
  std::vector<fs::path> files = measurement_inputs(request, open);
  files.emplace_back("/proc/self/exe");
  for (const auto& file : {open.campaign.images_table, open.campaign.targets}) {
    if (file) files.push_back(*file);
  }
  return files;
}

// A file that was written since may not be the one that was read.
bool is_older_than(const fs::path& file, fs::file_time_type time) {
  constexpr std::chrono::milliseconds kClockTick(10);
  std::error_code error;
  const fs::file_time_type written = fs::last_write_time(file, error);
  return error || written < time - kClockTick;
}

std::vector<FileHash> hashes_of(const std::vector<fs::path>& files, ReadFor purpose) {
  std::vector<FileHash> hashes;
  for (const fs::path& file : files) hashes.emplace_back(file.string(), hash_if_readable(file, purpose));
  return hashes;
}

bool all_unchanged(const std::vector<FileHash>& files, ReadFor purpose, int threads) {
  std::vector<char> same(files.size(), 0);
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  arena.execute([&] {
    tbb::parallel_for(std::size_t{0}, files.size(), [&](std::size_t i) {
      same[i] = hash_if_readable(files[i].first, purpose) == files[i].second ? 1 : 0;
    });
  });
  return std::find(same.begin(), same.end(), 0) == same.end();
}

}  // namespace

std::optional<MeasurementAnswer> unchanged_measurement(const MeasureRequest& request,
                                                       const OpenCampaign& open) {
  const fs::path path = record_file(open);
  if (!request.cache || !fs::exists(path)) return std::nullopt;
  try {
    const std::string text = read_file(path, ReadFor::own_result);
    const auto kept = unsealed_json(text);
    if (!kept) return std::nullopt;
    const auto record = nlohmann::json::parse(*kept);
    if (record.at("circumstances").get<std::string>() != circumstances(request, open)) return std::nullopt;
    const auto read = record.at("read").get<std::vector<FileHash>>();
    if (read != hashes_of(files_read(request, open), ReadFor::input)) return std::nullopt;
    MeasurementAnswer answer;
    answer.text = record.at("text").get<std::string>();
    answer.exit_code = record.at("exit_code").get<int>();
    const auto written = record.at("written").get<std::vector<FileHash>>();
    for (const FileHash& file : written) answer.written.emplace_back(file.first);
    if (!all_unchanged(written, ReadFor::own_result, request.threads) ||
        !all_unchanged(record.at("photographs").get<std::vector<FileHash>>(), ReadFor::input,
                       request.threads)) {
      return std::nullopt;
    }
    return answer;
  } catch (const nlohmann::json::exception&) {
  } catch (const InputError&) {
    // It cannot be read: it is made anew.
  }
  return std::nullopt;
}

void keep_measurement(const MeasureRequest& request, const OpenCampaign& open,
                      const CampaignObservations& observations, const MeasurementAnswer& answer) {
  const std::vector<fs::path> read = files_read(request, open);
  if (!request.cache ||
      !std::ranges::all_of(read, [&](const fs::path& file) { return is_older_than(file, open.opened); })) {
    return;
  }
  std::vector<FileHash> photographs;
  for (std::size_t i = 0; i < open.listing.images.size(); ++i) {
    // What was decoded counts, not what may have taken its place since.
    const PhotographObservations& seen = observations.photographs[i].seen;
    const bool was_empty = seen.status == PhotographStatus::empty;
    photographs.emplace_back(open.listing.images[i].path.string(), was_empty ? sha256_hex("") : seen.sha256);
  }
  const nlohmann::ordered_json record{{"circumstances", circumstances(request, open)},
                                      {"read", hashes_of(read, ReadFor::input)},
                                      {"photographs", photographs},
                                      {"written", hashes_of(answer.written, ReadFor::own_result)},
                                      {"exit_code", answer.exit_code},
                                      {"text", answer.text}};
  write_file_atomically(record_file(open), sealed_json(json_text(record, 1)), Keep::unless_power_fails);
}

}  // namespace hexcal
