#include "tools/hexcal/marker_visibility.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace hexcal {
namespace {

constexpr double kSteepestRad = 65 * kRadPerDeg;
constexpr std::ptrdiff_t kFewestMarkers = 2;
constexpr std::ptrdiff_t kFewestPhotographs = 2;

bool shows(const CameraModel& camera, const Rigid3& camera_from_LG,
           const std::array<Eigen::Vector3d, 4>& corners_in_LG) {
  std::array<Eigen::Vector3d, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) {
    corners[i] = camera_from_LG * corners_in_LG[i];
    const auto px = camera.project(corners[i]);
    if (!px || !camera.contains(*px)) return false;
  }
  // x runs from corner 0 to 1, y from 3 to 0, z towards the viewer (CONVENTIONS.md).
  const Eigen::Vector3d normal = (corners[1] - corners[0]).cross(corners[0] - corners[3]).normalized();
  const Eigen::Vector3d to_camera = -(corners[0] + corners[2]).normalized();
  return normal.dot(to_camera) >= std::cos(kSteepestRad);
}

}  // namespace

bool can_be_measured(const MeasuredNetwork& network, const CameraModel& camera, const Pose& pose,
                     double gd_mm) {
  const Rigid3 UG_from_LG = ug_from_lg(pose, gd_mm);
  const auto measures = [&](const auto& stations_of_pose) {
    const auto& stations = stations_of_pose.second;
    return std::count_if(stations.begin(), stations.end(), [&](const Rigid3& UG_from_camera) {
             const Rigid3 camera_from_LG = inverse(UG_from_camera) * UG_from_LG;
             return std::count_if(network.moving_markers.begin(), network.moving_markers.end(),
                                  [&](const auto& marker) {
                                    return shows(camera, camera_from_LG, marker.second);
                                  }) >= kFewestMarkers;
           }) >= kFewestPhotographs;
  };
  const std::ptrdiff_t able = std::count_if(network.stations.begin(), network.stations.end(), measures);
  return 2 * able >= static_cast<std::ptrdiff_t>(network.stations.size());
}

}  // namespace hexcal
