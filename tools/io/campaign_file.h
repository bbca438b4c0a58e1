#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pose_extract/campaign.h"

namespace hexcal {

/// Reads campaign.yaml, or the campaign.yaml of a folder. Paths in it are relative to it. Every key is known
/// or an InputError; sizes and lengths have no defaults. Reads the files of nominal coordinates too;
/// photographs, camera and tables are only named. Keys:
///
///   key                     value
///   camera                  camera.yaml, a library's folder, or a list of {file, serial | folder}
///   hexapod, targets, legs  files; all three optional here
///   images                  folder of photographs; images_table (file,pose) when it is flat
///   markers                 {family, fixed: {ids, size_mm}, moving: {ids, size_mm}};
///                           ids: [0-9, 12] or a map {100: 24, 101: 12} of sizes
///   frames.UG, frames.LG    {from: nominal, file},
///                           {from: markers, xyz_mm, rpy_deg} (UG only: no coordinates, see
///                           frame_from_markers; both optional),
///                           {from: home, pose, gd_mm} (LG only), or
///                           {from: features, z: {plane: [..]}, x: {line: [..]}, origin: {circle: [..]},
///                            offset_mm: [0, 0, 0], tolerance_mm}
///   scale                   {from: markers, print_scale_sigma: 0.001} (the default; less where the print's
///                           edges were measured), {from: nominal}, or
///                           {from: bars, bars: [{a: 0.1, b: 9.2, length_mm, sigma_mm}]};
///                           bars beside another source are compared with it
///   checks                  [{a: 0, b: 5, length_mm: 182.41, sigma_mm: 0.01}]: compared, never used
[[nodiscard]] Campaign read_campaign(const std::filesystem::path& folder_or_file);

/// The same of a text that is to be `file`.
[[nodiscard]] Campaign parse_campaign(const std::string& text, const std::filesystem::path& file);

/// Nominal coordinates: id,corner,x_mm,y_mm,z_mm[,sigma_mm]; an empty corner is the marker's centre, an empty
/// sigma_mm (zero in the result) is left to the fit to tell.
[[nodiscard]] std::vector<NominalPoint> read_nominal_points(const std::filesystem::path& path);

/// The table of a flat folder: file,pose.
struct ImageRow {
  std::string file;
  std::string pose;
};
[[nodiscard]] std::vector<ImageRow> read_images_table(const std::filesystem::path& path);

}  // namespace hexcal
