#include "tools/campaign/open_campaign.h"

#include <fmt/format.h>

#include <algorithm>

#include "kinematics/geometry/input_error.h"
#include "photogrammetry/photograph/sha256.h"
#include "tools/campaign/capture_groups.h"
#include "tools/io/atomic_file.h"
#include "tools/io/camera_file.h"
#include "tools/io/campaign_file.h"

namespace hexcal {
namespace fs = std::filesystem;
OpenCampaign open_campaign(const MeasureRequest& request) {
  const auto before_reading = fs::file_time_type::clock::now();
  OpenCampaign open = open_campaign(request, read_campaign(request.campaign));
  open.opened = before_reading;
  return open;
}

OpenCampaign open_campaign(const MeasureRequest& request, Campaign of) {
  constexpr int kMostThreads = 256;
  if (request.threads < 0 || request.threads > kMostThreads)
    throw InputError(
        fmt::format("threads: found {}, wanted 0 (all processors) to {}", request.threads, kMostThreads));
  OpenCampaign open;
  open.opened = fs::file_time_type::clock::now();
  open.campaign = std::move(of);
  if (request.home) {
    if (!open.campaign.lg || open.campaign.lg->from != FrameRule::From::home) {
      throw InputError(fmt::format("--home {}: found, but frames.LG of {} is not from home", *request.home,
                                   open.campaign.file.string()));
    }
    open.campaign.lg->home_pose = *request.home;
  }
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
  options.camera_folders = camera_folders(campaign);
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
  return open;
}

std::vector<std::string> camera_folders(const Campaign& campaign) {
  std::vector<std::string> folders;
  for (const CampaignCamera& camera : campaign.cameras) {
    if (!camera.folder.empty()) folders.push_back(camera.folder);
  }
  return folders;
}

int camera_for(const OpenCampaign& open, const std::string& folder, const PhotographInfo& info) {
  const std::vector<CampaignCamera>& cameras = open.campaign.cameras;
  std::vector<int> by_folder;
  std::vector<int> by_serial;
  std::vector<int> for_all;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const CampaignCamera& camera = cameras[c];
    if (!camera.folder.empty()) {
      if (camera.folder == folder) by_folder.push_back(static_cast<int>(c));
    } else if (!camera.serial.empty()) {
      if (camera.serial == info.serial.value_or("")) by_serial.push_back(static_cast<int>(c));
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
    const auto differences = compare_setting(camera.setting, info);
    if (std::none_of(differences.begin(), differences.end(),
                     [](const SettingDifference& difference) { return difference.fatal; })) {
      return c;
    }
  }
  return candidates.front();
}

std::vector<fs::path> measurement_inputs(const MeasureRequest& request, const OpenCampaign& open) {
  std::vector<fs::path> inputs{open.campaign.file};
  for (const CampaignCamera& camera : open.campaign.cameras) inputs.push_back(camera.file);
  for (const auto* rule : {&open.campaign.ug, &open.campaign.lg}) {
    if (*rule && (*rule)->nominal_file) inputs.push_back(*(*rule)->nominal_file);
  }
  if (request.observations) inputs.push_back(*request.observations);
  return inputs;
}

}  // namespace hexcal
