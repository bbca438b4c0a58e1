#include "tools/synthetic/stations.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kinematics/geometry/pose.h"

namespace hexcal {

Rigid3 looking_at(const Eigen::Vector3d& position, const Eigen::Vector3d& target, const Eigen::Vector3d& up,
                  double roll_rad) {
  Eigen::Matrix3d world_from_camera;
  world_from_camera.col(2) = (target - position).normalized();
  world_from_camera.col(0) = world_from_camera.col(2).cross(up).normalized();
  world_from_camera.col(1) = world_from_camera.col(2).cross(world_from_camera.col(0));
  const Rigid3 turned(quaternion_from_rotation_vector({0, 0, roll_rad}), Eigen::Vector3d::Zero());
  return turned * inverse(Rigid3(world_from_camera, position));
}

std::vector<Rigid3> pose_stations(RandomSource& random, int count, double distance_mm) {
  constexpr double kHalfSpreadDeg = 35;
  constexpr std::array kElevationsDeg{10.0, 27.0, -5.0};
  std::vector<Rigid3> stations;
  for (int i = 0; i < count; ++i) {
    const double place = count > 1 ? 2.0 * i / (count - 1) - 1 : 0;
    const double azimuth = (kHalfSpreadDeg * place + 3 * random.normal()) * kRadPerDeg;
    const double elevation =
        (kElevationsDeg[static_cast<std::size_t>(i % 3)] + 2 * random.normal()) * kRadPerDeg;
    const double distance = distance_mm * (1 + 0.03 * random.normal());
    const Eigen::Vector3d target(0, 8 * random.normal(), -25 + 6 * random.normal());
    const Eigen::Vector3d way(std::cos(elevation) * std::cos(azimuth),
                              std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
    stations.push_back(looking_at(target + distance * way, target, Eigen::Vector3d::UnitZ(),
                                  4 * kRadPerDeg * random.normal()));
  }
  return stations;
}

std::vector<Rigid3> sheet_stations(RandomSource& random, int count, const CameraModel& camera,
                                   const Eigen::Vector2d& extent_mm) {
  constexpr double kGoldenAngleDeg = 137.507764;
  // At this distance a frontal photograph just holds the sheet.
  const double full =
      camera.fy_px() * std::max(extent_mm.x() / camera.width_px, extent_mm.y() / camera.height_px);
  std::vector<Rigid3> stations;
  for (int i = 0; i < count; ++i) {
    const double tilt = (i % 5 == 0 ? random.uniform(3, 8) : random.uniform(20, 40)) * kRadPerDeg;
    const double side = (kGoldenAngleDeg * i + 10 * random.normal()) * kRadPerDeg;
    const double distance = full * (i % 5 == 0 ? random.uniform(0.95, 1.1) : random.uniform(0.72, 1.0));
    const Eigen::Vector3d target(extent_mm.x() * random.uniform(-0.16, 0.16),
                                 extent_mm.y() * random.uniform(-0.16, 0.16), 0);
    const Eigen::Vector3d way(std::sin(tilt) * std::cos(side), std::sin(tilt) * std::sin(side),
                              std::cos(tilt));
    const double quarter = i % 4 == 0 ? 0 : 90.0 * (i % 4);
    stations.push_back(looking_at(target + distance * way, target, Eigen::Vector3d::UnitY(),
                                  (quarter + 5 * random.normal()) * kRadPerDeg));
  }
  return stations;
}

}  // namespace hexcal
