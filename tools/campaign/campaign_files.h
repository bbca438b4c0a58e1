#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "camera_calib/calibrated_camera.h"
#include "camera_calib/sheet.h"

namespace hexcal {

/// What the YAML files of a folder that has no campaign.yaml yet are, told by what can read them.
struct CampaignFiles {
  std::vector<Sheet> sheets;           ///< for the camera
  std::vector<Sheet> printed_markers;  ///< sheets of stickers for the grips
  std::optional<CalibratedCamera> camera;
  std::filesystem::path camera_file;
};

/// Looks through the folder and those in it. A file that is named outright counts instead of what is found;
/// InputError if that one cannot be read. Of several camera files camera.yaml of the folder itself is taken,
/// else the first.
[[nodiscard]] CampaignFiles find_campaign_files(const std::filesystem::path& folder,
                                                const std::optional<std::filesystem::path>& camera,
                                                const std::optional<std::filesystem::path>& sheet);

}  // namespace hexcal
