#pragma once

#include <Eigen/Core>

#include "tools/synthetic/camera_effects.h"

namespace hexcal {

/// Between linear sRGB and a sensor's own red, green and blue, as DNG describes it: white (D65) is 1, 1, 1 in
/// sRGB and in the white-balanced sensor; `balance` is what the raw values are multiplied by, 1 for green.
struct NativeColour {
  Eigen::Matrix3f balanced_from_srgb = Eigen::Matrix3f::Identity();
  Eigen::Matrix3f srgb_from_balanced = Eigen::Matrix3f::Identity();
  Eigen::Vector3f balance{1, 1, 1};

  NativeColour() = default;
  explicit NativeColour(const std::array<double, 9>& camera_from_xyz);
};

}  // namespace hexcal
