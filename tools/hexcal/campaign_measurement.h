#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pose_extract/extract_poses.h"
#include "pose_extract/image_folders.h"

namespace hexcal {

/// What `measure`, `watch` and `run` were asked for.
struct MeasureRequest {
  std::filesystem::path campaign;                     ///< folder or campaign.yaml
  std::optional<std::filesystem::path> poses_dir;     ///< instead of the campaign's images
  std::optional<std::filesystem::path> output;        ///< of poses.csv; default results/poses.csv
  std::optional<std::filesystem::path> observations;  ///< use these and no photographs
  std::optional<double> group_by_time_s;              ///< flat folder: a longer pause begins a new pose
  bool interior_fixed = false;                        ///< keep the interior orientation of the camera file
  int map_poses = 0;  ///< poses that the map of the markers is made of; 0: all in one adjustment
  bool cache = true;
  bool overlays = false;
  bool colmap = false;
  bool allow_empty = false;  ///< a folder without photographs is no error
  int threads = 0;           ///< 0: all
};

/// A campaign as its files say, read and checked.
struct OpenCampaign {
  Campaign campaign;
  std::filesystem::path results;  ///< folder of the results
  std::filesystem::path poses_csv;
  std::vector<CalibratedCamera> cameras;
  std::vector<std::string> camera_sha256;  ///< of the camera files
  const MarkerFamily* family = nullptr;
  DetectionOptions detection;
  ImageListing listing;
  std::vector<int> camera_of_image;  ///< per image of the listing; -1: none is for it
};

/// Reads campaign.yaml, the cameras and the image folders. Throws InputError for what is wrong in them.
[[nodiscard]] OpenCampaign open_campaign(const MeasureRequest& request);

/// Holds results/.lock while it lives, so that two runs on one campaign do not mix. Throws InputError if
/// another process holds it; inside the process that does, a second one changes nothing. The lock vanishes
/// with the process, however it ends.
class CampaignLock {
 public:
  explicit CampaignLock(const std::filesystem::path& results);
  CampaignLock(const CampaignLock&) = delete;
  CampaignLock& operator=(const CampaignLock&) = delete;
  ~CampaignLock();

 private:
  int file_ = -1;
  std::filesystem::path folder_;
};

/// Decodes photographs and finds their markers, one photograph per thread at a time; results are kept in
/// results/cache by content and camera, so that only new photographs cost time. `advance` is called after
/// each.
[[nodiscard]] CampaignObservations observe_campaign(const MeasureRequest& request, const OpenCampaign& open,
                                                    const std::function<void()>& advance);

[[nodiscard]] ExtractOptions extract_options(const MeasureRequest& request);

/// SHA-256 of a file's content; empty if it cannot be read (whoever needs the content says why).
[[nodiscard]] std::string hash_if_readable(const std::filesystem::path& path);

/// One photograph, through the cache.
[[nodiscard]] PhotographObservations observe_image(const OpenCampaign& open, std::size_t image,
                                                   bool use_cache);

/// The observations of a file written by `hexcal detect` as those of the campaign: `folder/name.jpg` is of
/// pose `folder`.
[[nodiscard]] CampaignObservations campaign_observations(const std::filesystem::path& file,
                                                         OpenCampaign& open);

/// What the campaign's other files say of the result, as remarks and warnings: folders whose names were
/// swapped (targets.csv), cameras without a covariance.
void judge_against_files(const OpenCampaign& open, CampaignResult& result);

/// The files whose numbers are in the results, beside the photographs.
[[nodiscard]] std::vector<std::filesystem::path> measurement_inputs(const MeasureRequest& request,
                                                                    const OpenCampaign& open);

/// Writes poses.csv and everything beside it; returns the files written.
std::vector<std::filesystem::path> write_results(const MeasureRequest& request, const OpenCampaign& open,
                                                 const CampaignObservations& observations,
                                                 const CampaignResult& result);

/// The lines for people, and the same for machines.
[[nodiscard]] std::string measurement_text(const CampaignObservations& observations,
                                           const CampaignResult& result, const ImageListing& listing);
[[nodiscard]] std::string measurement_json(const CampaignObservations& observations,
                                           const CampaignResult& result, const ImageListing& listing);

/// kDone, or kSomeFailed when a pose or photograph is not ok.
[[nodiscard]] int measurement_exit_code(const CampaignResult& result);

}  // namespace hexcal
