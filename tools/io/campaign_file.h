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
///   camera: camera.yaml               or a list [{file, serial | folder}], one per camera of the campaign
///   hexapod, targets, legs            optional here
///   images: poses                     folder; images_table: images.csv (file,pose) when it is flat
///   markers: {family, fixed: {ids: [0-9], size_mm: 24}, moving: {ids: {100: 24, 101: 12}}}
///   frames: {UG: {from: nominal, file}, LG: {from: home, pose, gd_mm}}
///           {from: features, z: {plane: [..]}, x: {line: [..]}, origin: {circle: [..]}, offset_mm: [0, 0,
///           0]}
///   scale: {from: markers, print_scale_sigma: 0.001}, {from: bars, bars: [{a: 0.1, b: 9.2, length_mm,
///   sigma_mm}]}
///           or {from: nominal}; bars beside another source are compared with it
///   checks: [{a: 0, b: 5, length_mm: 182.41, sigma_mm: 0.01}]
[[nodiscard]] Campaign read_campaign(const std::filesystem::path& folder_or_file);

/// Nominal coordinates: id,corner,x_mm,y_mm,z_mm[,sigma_mm]; an empty corner is the marker's centre.
[[nodiscard]] std::vector<NominalPoint> read_nominal_points(const std::filesystem::path& path);

/// The table of a flat folder: file,pose.
struct ImageRow {
  std::string file;
  std::string pose;
};
[[nodiscard]] std::vector<ImageRow> read_images_table(const std::filesystem::path& path);

}  // namespace hexcal
