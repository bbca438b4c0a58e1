#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "kinematics/geometry/pose.h"

namespace hexcal {

/// Where the frame of the targets stands in the one in which poses were measured.
struct TargetAlignment {
  Rigid3 measured_from_targets;
  double rms_deg = 0;  ///< of the rotations that remain between measured and commanded motions
};

/// Best fit of measured motions to commanded ones, both relative to home: target, measured per pose. `gd_mm`
/// is that of both frames. What the motions leave open (a shift along an axis about which nothing turns)
/// stays as it is. Solves A X = X B as rotations (Park and Martin, IEEE T. Robot. Autom. 10 (1994) 717), then
/// translations. Nothing for fewer than three poses, or if they turn about fewer than two axes.
[[nodiscard]] std::optional<TargetAlignment> align_with_targets(
    const std::vector<std::pair<Pose, Pose>>& target_and_measured, const Pose& home_target, double gd_mm);

}  // namespace hexcal
