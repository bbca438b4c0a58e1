#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "kinematics/geometry/rigid3.h"

namespace hexcal {

/// What `measure` found out about where photographs were taken and where the moving markers sit.
struct MeasuredNetwork {
  /// UG_from_camera of the photographs of each pose; photographs that could not be placed are left out.
  std::map<std::string, std::vector<Rigid3>> stations;
  /// Corners 0 to 3 of each moving marker in LG, mm.
  std::map<int, std::array<Eigen::Vector3d, 4>> moving_markers;
};

/// Reads photos.csv and markers.csv of a results folder. Throws InputError as CsvTable does, and where they
/// hold no station or no moving marker.
[[nodiscard]] MeasuredNetwork read_measured_network(const std::filesystem::path& results);

}  // namespace hexcal
