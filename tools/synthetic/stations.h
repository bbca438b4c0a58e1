#pragma once

#include <cstdint>
#include <vector>

#include "kinematics/geometry/rigid3.h"
#include "photogrammetry/camera/camera_model.h"
#include "tools/synthetic/random_source.h"

namespace hexcal {

/// camera_from_world of a camera that looks at a point, its x axis level, then turned about its axis.
[[nodiscard]] Rigid3 looking_at(const Eigen::Vector3d& position, const Eigen::Vector3d& target,
                                const Eigen::Vector3d& up, double roll_rad);

/// Stations for one pose of the grips, hand held: spread over 70 deg from left to right, alternately high and
/// low, with jitter. World = UG.
[[nodiscard]] std::vector<Rigid3> pose_stations(RandomSource& random, int count, double distance_mm);

/// Stations for photographs of a sheet that covers `extent_mm`: tilted 20 to 40 deg (every fifth nearly
/// frontal), turned by quarter turns, near enough that most photographs show a part of the sheet only and
/// together reach all corners of the frame. World = sheet.
[[nodiscard]] std::vector<Rigid3> sheet_stations(RandomSource& random, int count, const CameraModel& camera,
                                                 const Eigen::Vector2d& extent_mm);

}  // namespace hexcal
