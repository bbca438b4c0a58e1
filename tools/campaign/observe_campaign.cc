#include "tools/campaign/observe_campaign.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <optional>
#include <set>

#include "kinematics/geometry/input_error.h"
#include "photogrammetry/photograph/photograph_file.h"
#include "photogrammetry/photograph/sha256.h"
#include "tools/io/atomic_file.h"
#include "tools/io/kept_text.h"
#include "tools/io/observations_file.h"
#include "tools/io/version.h"

namespace hexcal {
namespace fs = std::filesystem;
namespace {

constexpr int kCacheFormat = 4;  // counts up when detection changes what it finds

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
    const std::string text = read_file(file, ReadFor::own_result);
    const auto kept = unsealed_text(text);
    if (!kept) return std::nullopt;  // an edited or damaged entry is made anew
    DetectionSet set = parse_observations(*kept, file);
    if (set.photographs.size() == 1) return std::move(set.photographs.front());
  } catch (const InputError&) {
    // It cannot be read: it is made anew.
  }
  return std::nullopt;
}

CampaignObservations observe_photographs(const MeasureRequest& request, const OpenCampaign& open,
                                         MeasurementObserver& observer) {
  const std::vector<CampaignImage>& images = open.listing.images;
  CampaignObservations observations;
  observations.cameras = open.cameras;
  observations.poses = open.listing.poses;
  observations.photographs.resize(images.size());
  observer.begin(images.size());
  tbb::task_arena arena(request.threads > 0 ? request.threads : tbb::task_arena::automatic);
  arena.execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, images.size(), 1),
        [&](const tbb::blocked_range<std::size_t>& range) {
          for (std::size_t i = range.begin(); i < range.end(); ++i) {
            // Isolated, so that a thread that waits inside does not begin another photograph: memory.
            tbb::this_task_arena::isolate(
                [&] { observations.photographs[i] = observe_image(open, images[i], request.cache); });
            observer.observed(observations.photographs[i]);
          }
        },
        tbb::simple_partitioner());
  });
  return observations;
}

CampaignObservations observations_of_file(const fs::path& file, OpenCampaign& open) {
  DetectionSet set = read_observations(file);
  if (set.family != open.campaign.family) {
    throw InputError(fmt::format("{}: found family {}, the campaign's is {}", file.string(), set.family,
                                 open.campaign.family));
  }
  if (!set.camera_sha256.empty() && open.cameras.size() == 1 && set.camera_sha256 != open.camera_sha256[0]) {
    throw InputError(fmt::format("{}: was detected with another camera file than {}", file.string(),
                                 open.campaign.cameras[0].file.string()));
  }
  std::vector<std::string> names;
  for (const PhotographObservations& seen : set.photographs) names.push_back(seen.name);
  const std::vector<ImagePlace> places = places_of_names(names, camera_folders(open.campaign));
  CampaignObservations observations;
  observations.cameras = open.cameras;
  std::set<std::string> poses;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (places[i].pose.empty()) {
      throw InputError(fmt::format("{}: photograph '{}': wanted its pose's folder before the name",
                                   file.string(), names[i]));
    }
    poses.insert(places[i].pose);
    const int camera = camera_for(open, places[i].camera_folder, set.photographs[i].info);
    observations.photographs.push_back({places[i].pose, camera, std::move(set.photographs[i])});
  }
  observations.poses.assign(poses.begin(), poses.end());
  std::sort(observations.poses.begin(), observations.poses.end(), natural_less);
  open.listing.poses = observations.poses;
  return observations;
}

}  // namespace

CampaignPhotograph observe_image(const OpenCampaign& open, const CampaignImage& image, bool use_cache) {
  const PhotographFile file = read_photograph_file(image.path);
  const bool exif_decides = open.cameras.size() > 1 || !open.campaign.cameras.front().serial.empty();
  const int camera = camera_for(open, image.folder, exif_decides ? photograph_info(file) : PhotographInfo{});
  use_cache = use_cache && camera >= 0 && file.status == PhotographStatus::ok;
  if (use_cache) {
    if (auto found = cached(cache_file(open, file.sha256, camera))) {
      found->name = image.name;
      return {image.pose, camera, std::move(*found)};
    }
  }
  const Photograph photograph = decode_photograph(file);
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
  seen.name = image.name;
  if (use_cache && fits && seen.status == PhotographStatus::ok) {
    const std::string& camera_sha256 = open.camera_sha256[static_cast<std::size_t>(camera)];
    write_file_atomically(cache_file(open, file.sha256, camera),
                          sealed_text(observations_text({open.campaign.family, camera_sha256, {seen}})),
                          Keep::unless_power_fails);
  }
  return {image.pose, camera, std::move(seen)};
}

CampaignObservations observe_campaign(const MeasureRequest& request, OpenCampaign& open,
                                      MeasurementObserver& observer) {
  return request.observations ? observations_of_file(*request.observations, open)
                              : observe_photographs(request, open, observer);
}

std::string observations_of_campaign(const std::string& head, const OpenCampaign& open,
                                     const CampaignObservations& observations) {
  std::vector<std::string> names;
  for (const CampaignPhotograph& photograph : observations.photographs) names.push_back(photograph.seen.name);
  const std::vector<ImagePlace> places = places_of_names(names, camera_folders(open.campaign));
  DetectionSet set{open.campaign.family, open.camera_sha256.size() == 1 ? open.camera_sha256[0] : "", {}};
  std::set<std::string> taken;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const CampaignPhotograph& photograph = observations.photographs[i];
    set.photographs.push_back(photograph.seen);
    // Poses that a table or the time of exposure tells apart are folders in the file.
    std::string& name = set.photographs.back().name;
    if (places[i].pose != photograph.pose) {
      const fs::path folder = fs::path(photograph.pose) / places[i].camera_folder;
      name = (folder / fs::path(names[i]).filename()).generic_string();
      if (taken.count(name) != 0) {  // of another folder
        std::replace(names[i].begin(), names[i].end(), '/', '_');
        name = (folder / names[i]).generic_string();
      }
    }
    taken.insert(name);
  }
  return observations_text(set, head);
}

}  // namespace hexcal
