#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pose_extract/extract_poses.h"

namespace hexcal {

/// photos.csv, a row per photograph: photo,pose,status,x_mm,...,yaw_deg,sigma_x_mm,...,sigma_yaw_deg,markers,
/// rejected,rms_px. The six are those of UG_from_camera, empty where it is unknown; status `ok`, `suspect:
/// why` or why the photograph was not used.
[[nodiscard]] std::string format_photo_table(const std::string& head,
                                             const CampaignObservations& observations,
                                             const CampaignResult& result);

/// A row of it.
struct PhotoRecord {
  std::string photo, pose, status;
  std::optional<Rigid3> UG_from_camera;
  int markers = 0;   ///< used
  int rejected = 0;  ///< seen, but against the rest
  double rms_px = 0;
};
/// Throws InputError as CsvTable does.
[[nodiscard]] std::vector<PhotoRecord> read_photo_table(const std::filesystem::path& path);

}  // namespace hexcal
