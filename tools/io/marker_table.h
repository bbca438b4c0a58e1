#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "pose_extract/extract_poses.h"

namespace hexcal {

/// markers.csv, the corners of the markers: id,corner,frame,x_mm,y_mm,z_mm,sigma_x_mm,...; frame UG or LG.
[[nodiscard]] std::string format_marker_table(const std::string& head, const CampaignResult& result);

/// A row of it.
struct MarkerCornerRecord {
  int id = -1;
  int corner = -1;
  std::string frame;
  Eigen::Vector3d xyz_mm;
};
/// Throws InputError as CsvTable does.
[[nodiscard]] std::vector<MarkerCornerRecord> read_marker_table(const std::filesystem::path& path);

/// epochs.csv: where each corner of the moving grip was in UG at each pose: pose,id,corner,x_mm,y_mm,z_mm.
[[nodiscard]] std::string format_epoch_table(const std::string& head, const CampaignResult& result);

}  // namespace hexcal
