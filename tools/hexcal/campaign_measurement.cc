#include "tools/hexcal/campaign_measurement.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <set>

#include "kinematics/geometry/input_error.h"
#include "photogrammetry/photograph/sha256.h"
#include "pose_extract/pose_verdict.h"
#include "tools/hexcal/capture_groups.h"
#include "tools/hexcal/version.h"
#include "tools/io/atomic_file.h"
#include "tools/io/camera_file.h"
#include "tools/io/campaign_file.h"
#include "tools/io/observations_file.h"
#include "tools/io/pose_table.h"

namespace hexcal {
namespace fs = std::filesystem;
namespace {

constexpr int kCacheFormat = 2;  // counts up when detection changes what it finds

// The camera a photograph is for: by folder, by the body's serial number, or one that is for all. Of several
// (one per zoom setting) the first whose image size and lens setting fit.
int camera_of(const OpenCampaign& open, const CampaignImage& image) {
  const auto& cameras = open.campaign.cameras;
  std::optional<PhotographInfo> info;
  const auto exif = [&]() -> const PhotographInfo& {
    if (!info) info = read_photograph_info(image.path);
    return *info;
  };
  std::vector<int> by_folder;
  std::vector<int> by_serial;
  std::vector<int> for_all;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const CampaignCamera& camera = cameras[c];
    if (!camera.folder.empty()) {
      if (camera.folder == image.folder) by_folder.push_back(static_cast<int>(c));
    } else if (!camera.serial.empty()) {
      if (camera.serial == exif().serial.value_or("")) by_serial.push_back(static_cast<int>(c));
    } else {
      for_all.push_back(static_cast<int>(c));
    }
  }
  const std::vector<int>& candidates = !by_folder.empty()   ? by_folder
                                       : !by_serial.empty() ? by_serial
                                                            : for_all;
  if (candidates.empty()) return -1;
  if (candidates.size() == 1) return candidates.front();
  for (const int c : candidates) {
    const CalibratedCamera& camera = open.cameras[static_cast<std::size_t>(c)];
    const auto differences = compare_setting(camera.setting, exif());
    if (std::none_of(differences.begin(), differences.end(),
                     [](const SettingDifference& difference) { return difference.fatal; })) {
      return c;
    }
  }
  return candidates.front();
}

std::string ids_text(const std::vector<int>& ids) {
  std::string text;
  for (const int id : ids) text += fmt::format(" {}", id);
  return text;
}

fs::path cache_file(const OpenCampaign& open, const std::string& photograph_sha256, int camera) {
  const std::string key = fmt::format("{} {} {} {} {}{}", kCacheFormat, kVersion, photograph_sha256,
                                      open.camera_sha256[static_cast<std::size_t>(camera)],
                                      open.campaign.family, ids_text(open.detection.ids));
  return open.results / "cache" / (sha256_hex(key) + ".txt");
}

std::optional<PhotographObservations> cached(const fs::path& file) {
  if (!fs::exists(file)) return std::nullopt;
  try {
    DetectionSet set = read_observations(file);
    if (set.photographs.size() == 1) return std::move(set.photographs.front());
  } catch (const InputError&) {
    // A damaged entry is made anew.
  }
  return std::nullopt;
}

}  // namespace

OpenCampaign open_campaign(const MeasureRequest& request) {
  OpenCampaign open;
  open.campaign = read_campaign(request.campaign);
  const Campaign& campaign = open.campaign;
  open.results = campaign.folder / "results";
  open.poses_csv = request.output.value_or(open.results / "poses.csv");
  for (const CampaignCamera& camera : campaign.cameras) {
    if (!fs::exists(camera.file)) {
      throw InputError(fmt::format(
          "{}: camera: {}: no such file; hexcal camera PHOTOGRAPHS --template SHEET -o {} makes it",
          campaign.file.string(), camera.file.string(), camera.file.string()));
    }
    open.cameras.push_back(read_camera_file(camera.file));
    open.camera_sha256.push_back(sha256_hex(read_file(camera.file)));
  }
  open.family = &marker_family(campaign.family);
  for (const MarkerSizes* sizes : {&campaign.fixed, &campaign.moving}) {
    for (const auto& [id, size] : *sizes) {
      if (static_cast<std::size_t>(id) >= open.family->patterns.size()) {
        throw InputError(fmt::format("{}: marker {}: {} has ids 0 to {}", campaign.file.string(), id,
                                     campaign.family, open.family->patterns.size() - 1));
      }
      open.detection.ids.push_back(id);
    }
  }
  std::sort(open.detection.ids.begin(), open.detection.ids.end());
  if (request.observations) return open;

  ListingOptions options;
  for (const CampaignCamera& camera : campaign.cameras) {
    if (!camera.folder.empty()) options.camera_folders.push_back(camera.folder);
  }
  const fs::path images = request.poses_dir.value_or(campaign.images);
  if (request.allow_empty && !fs::exists(images)) return open;
  if (campaign.images_table && !request.poses_dir) {
    for (const ImageRow& row : read_images_table(*campaign.images_table))
      options.table.emplace_back(row.file, row.pose);
  }
  if (request.group_by_time_s) {
    CaptureGroups groups = group_by_capture_time(images, *request.group_by_time_s);
    options.table = std::move(groups.table);
    open.listing = list_images(images, options);
    open.listing.skipped = std::move(groups.skipped);
  } else {
    open.listing = list_images(images, options);
  }
  if (open.listing.images.empty() && !request.allow_empty) {
    throw InputError(fmt::format("{}: holds no photographs", images.string()));
  }
  for (const CampaignImage& image : open.listing.images)
    open.camera_of_image.push_back(camera_of(open, image));
  return open;
}

namespace {

// Folders that this process holds: `run` holds its campaign for all of its stages.
std::set<fs::path>& held_folders() {
  static std::set<fs::path> held;
  return held;
}

}  // namespace

CampaignLock::CampaignLock(const fs::path& results) {
  std::error_code error;
  fs::create_directories(results, error);
  if (error) throw InputError(fmt::format("{}: cannot create: {}", results.string(), error.message()));
  const fs::path path = results / ".lock";
  folder_ = fs::weakly_canonical(results, error);
  if (held_folders().count(folder_) != 0) return;
  refuse_linked_folders(results);
  file_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644);
  if (file_ < 0)
    throw InputError(fmt::format("{}: cannot be written: {}", path.string(), std::strerror(errno)));
  if (::flock(file_, LOCK_EX | LOCK_NB) != 0) {
    ::close(file_);
    throw InputError(fmt::format("{}: another hexcal is working on this campaign; wait for it or stop it",
                                 results.parent_path().string()));
  }
  held_folders().insert(folder_);
  remove_abandoned_files(results);
  remove_abandoned_files(results / "cache");
}

CampaignLock::~CampaignLock() {
  if (file_ < 0) return;
  held_folders().erase(folder_);
  ::close(file_);
}

std::string hash_if_readable(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return {};
  try {
    return sha256_hex(read_file(path));
  } catch (const InputError&) {  // no right to read it, or it is gone since
    return {};
  }
}

PhotographObservations observe_image(const OpenCampaign& open, std::size_t image, bool use_cache) {
  const CampaignImage& entry = open.listing.images[image];
  const int camera = open.camera_of_image[image];
  const std::string sha = use_cache && camera >= 0 ? hash_if_readable(entry.path) : std::string();
  if (!sha.empty()) {
    if (auto found = cached(cache_file(open, sha, camera))) {
      found->name = entry.name;
      return *found;
    }
  }
  const Photograph photograph = read_photograph(entry.path);
  const CameraModel* model = camera >= 0 ? &open.cameras[static_cast<std::size_t>(camera)].model : nullptr;
  // A lens of another frame size would mislead the refiner; screening names the photograph.
  const bool fits =
      model != nullptr && photograph.grey.cols == model->width_px && photograph.grey.rows == model->height_px;
  PhotographObservations seen;
  if (photograph.status == PhotographStatus::ok && !fits) {
    seen.status = photograph.status;
    seen.info = photograph.info;
    seen.info.width_px = photograph.grey.cols;
    seen.info.height_px = photograph.grey.rows;
    seen.sha256 = photograph.sha256;
  } else {
    seen = observe_photograph(photograph, *open.family, open.detection, model);
  }
  seen.name = entry.name;
  if (use_cache && fits && seen.status == PhotographStatus::ok && seen.sha256 == sha) {
    const std::string& camera_sha256 = open.camera_sha256[static_cast<std::size_t>(camera)];
    write_file_atomically(cache_file(open, sha, camera),
                          observations_text({open.campaign.family, camera_sha256, {seen}}),
                          Keep::unless_power_fails);
  }
  return seen;
}

ExtractOptions extract_options(const MeasureRequest& request) {
  ExtractOptions options;
  options.map_poses = request.map_poses;
  if (request.interior_fixed) options.adjustment.interior = AdjustmentOptions::Interior::fixed;
  return options;
}

CampaignObservations observe_campaign(const MeasureRequest& request, const OpenCampaign& open,
                                      const std::function<void()>& advance) {
  CampaignObservations observations;
  observations.cameras = open.cameras;
  observations.poses = open.listing.poses;
  observations.photographs.resize(open.listing.images.size());
  tbb::task_arena arena(request.threads > 0 ? request.threads : tbb::task_arena::automatic);
  arena.execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, open.listing.images.size(), 1),
        [&](const tbb::blocked_range<std::size_t>& range) {
          for (std::size_t i = range.begin(); i < range.end(); ++i) {
            // Isolated, so that a thread that waits inside does not begin another photograph: memory.
            tbb::this_task_arena::isolate([&] {
              observations.photographs[i] = {open.listing.images[i].pose, open.camera_of_image[i],
                                             observe_image(open, i, request.cache)};
            });
            if (advance) advance();
          }
        },
        tbb::simple_partitioner());
  });
  return observations;
}

CampaignObservations campaign_observations(const fs::path& file, OpenCampaign& open) {
  const DetectionSet set = read_observations(file);
  if (set.family != open.campaign.family) {
    throw InputError(fmt::format("{}: found family {}, the campaign's is {}", file.string(), set.family,
                                 open.campaign.family));
  }
  if (!set.camera_sha256.empty() && open.cameras.size() == 1 && set.camera_sha256 != open.camera_sha256[0]) {
    throw InputError(fmt::format("{}: was detected with another camera file than {}", file.string(),
                                 open.campaign.cameras[0].file.string()));
  }
  CampaignObservations observations;
  observations.cameras = open.cameras;
  std::set<std::string> poses;
  for (const PhotographObservations& seen : set.photographs) {
    const std::string pose = fs::path(seen.name).parent_path().filename().string();
    if (pose.empty()) {
      throw InputError(fmt::format("{}: photograph '{}': wanted its pose's folder before the name",
                                   file.string(), seen.name));
    }
    poses.insert(pose);
    int camera = 0;
    for (std::size_t c = 0; c < open.campaign.cameras.size(); ++c) {
      const CampaignCamera& known = open.campaign.cameras[c];
      if (!known.serial.empty() && known.serial == seen.info.serial.value_or(""))
        camera = static_cast<int>(c);
    }
    observations.photographs.push_back({pose, camera, seen});
  }
  observations.poses.assign(poses.begin(), poses.end());
  std::sort(observations.poses.begin(), observations.poses.end(), natural_less);
  open.listing.poses = observations.poses;
  return observations;
}

void judge_against_files(const OpenCampaign& open, CampaignResult& result) {
  for (std::size_t c = 0; c < open.cameras.size(); ++c) {
    if (open.cameras[c].covariance.size() > 0) continue;
    result.warnings.push_back(
        fmt::format("{} states no covariance: the sigmas of the poses leave the camera's own error out",
                    open.campaign.cameras[c].file.filename().string()));
  }
  if (!open.campaign.targets) return;
  std::map<std::string, Pose> commanded;
  try {
    for (const PoseRecord& record : read_pose_table(*open.campaign.targets)) {
      if (record.pose) commanded[record.id] = *record.pose;
    }
  } catch (const InputError& error) {
    // The measurement needs no targets.
    result.warnings.push_back(fmt::format("not compared with the targets: {}", error.what()));
    return;
  }
  std::vector<std::optional<Pose>> targets;
  for (const MeasuredPose& pose : result.poses) {
    const auto found = commanded.find(pose.id);
    targets.push_back(found == commanded.end() ? std::nullopt : std::optional<Pose>(found->second));
  }
  judge_swapped_folders(targets, result);
}

}  // namespace hexcal
