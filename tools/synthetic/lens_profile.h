#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "photogrammetry/camera/camera_model.h"

namespace hexcal {

/// Nikon D3200: sensor width in mm and frame of 6016 x 4000 pixels; other widths keep the aspect.
inline constexpr double kSensorWidthMm = 23.2;
inline constexpr int kSensorWidthPx = 6016;
inline constexpr int kSensorHeightPx = 4000;
[[nodiscard]] int frame_height_px(int width_px);

/// Focal lengths (mm) at which the public lens profile was measured.
[[nodiscard]] const std::vector<double>& profile_focal_lengths_mm();

/// The AF-S DX 18-105 by its public profile (lensfun, slr-nikon.xml, model ptlens) in the form that keeps the
/// paraxial focal length: with t = tan(angle), r = t (1 + c' t + b' t^2 + a' t^3), which LensModel::radial
/// holds exactly. The principal point is the middle of the frame. Between the profile's focal lengths the
/// terms times focal length are interpolated linearly. Throws InputError outside 18 to 105 mm.
[[nodiscard]] CameraModel profile_camera(double focal_mm, int width_px);

/// Where a colour falls that green puts at distance r from the principal point: r (v + b r^2), r in
/// `unit_px`.
struct LateralColour {
  double unit_px = 1;
  std::array<double, 3> v{1, 1, 1};  ///< red, green, blue
  std::array<double, 3> b{0, 0, 0};
};

/// Of the public profile (lensfun, tca poly3), between its focal lengths as profile_camera().
[[nodiscard]] LateralColour profile_lateral_colour(double focal_mm, int width_px);

/// Brown-Conrady camera of about the same size of distortion.
[[nodiscard]] CameraModel brown_camera(double focal_mm, int width_px);

}  // namespace hexcal
