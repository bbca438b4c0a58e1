#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pose_extract/extract_poses.h"
#include "pose_extract/image_folders.h"

namespace hexcal {

/// What is asked of a measurement, by whatever command or caller.
struct MeasureRequest {
  std::filesystem::path campaign;                     ///< folder or campaign.yaml
  std::optional<std::filesystem::path> poses_dir;     ///< instead of the campaign's images
  std::optional<std::filesystem::path> output;        ///< of poses.csv; default results/poses.csv
  std::optional<std::filesystem::path> observations;  ///< use these and no photographs
  std::optional<std::string> home;                    ///< this pose defines LG, not campaign.yaml's
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
  std::filesystem::file_time_type opened;  ///< before the first of its files was read
  Campaign campaign;
  std::filesystem::path results;  ///< folder of the results
  std::filesystem::path poses_csv;
  std::vector<CalibratedCamera> cameras;
  std::vector<std::string> camera_sha256;  ///< of the camera files
  const MarkerFamily* family = nullptr;
  DetectionOptions detection;
  ImageListing listing;  ///< empty where observations were given
};

/// Reads campaign.yaml, the cameras and the image folders, no photograph. Throws InputError for what is wrong
/// in them.
[[nodiscard]] OpenCampaign open_campaign(const MeasureRequest& request);

/// The same of a campaign that was read, or is to be written.
[[nodiscard]] OpenCampaign open_campaign(const MeasureRequest& request, Campaign of);

/// The campaign's camera that a photograph in camera folder `folder` (empty: in none) with these EXIF entries
/// is for: that of the folder, else that of the body's serial number, else one that is for all. Of several
/// (one per zoom setting) the first whose image size and lens setting fit. -1: none.
[[nodiscard]] int camera_for(const OpenCampaign& open, const std::string& folder, const PhotographInfo& info);

/// The names of the folders that tell the campaign's cameras apart.
[[nodiscard]] std::vector<std::string> camera_folders(const Campaign& campaign);

/// The files whose numbers are in the results, beside the photographs.
[[nodiscard]] std::vector<std::filesystem::path> measurement_inputs(const MeasureRequest& request,
                                                                    const OpenCampaign& open);

}  // namespace hexcal
