#pragma once

#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "kinematics/platform.h"

namespace hexcal {

/// P. Dietmaier's platform with 40 real postures (ARK 1998), from the data folder beside the project.
struct Dietmaier {
  PlatformGeometry geometry;
  LegVector lengths;
  std::vector<Rigid3> postures;  ///< B_from_P
  std::vector<double> sigma_min;
};

inline std::optional<Dietmaier> read_dietmaier() {
  const std::filesystem::path folder = std::filesystem::path(HEXCAL_SOURCE) / "../shared/data/dietmaier";
  const auto rows = [&folder](const char* file) {
    std::ifstream in(folder / file);
    std::vector<std::vector<double>> numbers;
    for (std::string line; std::getline(in, line);) {
      if (line.empty() || line[0] == '#' || std::isalpha(static_cast<unsigned char>(line[0])) != 0) continue;
      std::stringstream fields(line);
      numbers.emplace_back();
      for (std::string field; std::getline(fields, field, ',');) numbers.back().push_back(std::stod(field));
    }
    return numbers;
  };
  const auto geometry = rows("geometry.csv");
  const auto postures = rows("solutions.csv");
  if (geometry.size() != 6 || postures.empty()) return std::nullopt;
  Dietmaier data;
  for (std::size_t i = 0; i < 6; ++i) {
    const std::vector<double>& g = geometry[i];
    data.geometry.base_joints_mm[i] = {g[1], g[2], g[3]};
    data.geometry.platform_joints_mm[i] = {g[4], g[5], g[6]};
    data.lengths[static_cast<Eigen::Index>(i)] = g[7];
    data.geometry.actuators[i] = {0, 1, 1e-3, 100};
  }
  for (const std::vector<double>& p : postures) {
    Eigen::Matrix3d r;
    r << p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11], p[12];
    data.postures.emplace_back(r, Eigen::Vector3d(p[1], p[2], p[3]));
    data.sigma_min.push_back(p[13]);
  }
  return data;
}

}  // namespace hexcal
