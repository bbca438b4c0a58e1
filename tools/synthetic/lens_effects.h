#pragma once

#include <array>
#include <cstdint>

#include "photogrammetry/camera/camera_model.h"
#include "tools/synthetic/camera_effects.h"
#include "tools/synthetic/lens_profile.h"
#include "tools/synthetic/render.h"

namespace hexcal {

/// Spreads the light of a rendered photograph as a real lens and a moving camera do: defocus by depth and
/// field curvature (needs SensorImage::depth_mm), shake, veiling glare. `focus_mm`: from the camera to the
/// plane in focus. `seed`: the photograph's.
void apply_lens_effects(SensorImage& image, const LensEffects& effects, double focal_mm, double focus_mm,
                        std::uint64_t seed);

/// Where the light of a pixel and channel is to be looked up in the rendered image: lateral colour (about the
/// principal point) and rolling shutter.
class ChannelShift {
 public:
  ChannelShift(const LensEffects& effects, const CameraModel& camera, double focal_mm, std::uint64_t seed);

  /// True if the channel is not moved at all.
  [[nodiscard]] bool none(std::size_t channel) const { return none_[channel]; }
  /// `channel` 0 red, 1 green, 2 blue.
  [[nodiscard]] Eigen::Vector2d source(int x, int y, std::size_t channel) const;

 private:
  std::array<bool, 3> none_{};
  LateralColour colour_;
  Eigen::Vector2d principal_px_;
  Eigen::Vector2d rows_px_;  ///< movement from the first row to the last
  double height_px_;
};

/// An image of one channel, CV_32FC1, between its pixels: degree 5 through the 6 x 6 nearest, to 1/512 px;
/// edges repeated.
[[nodiscard]] float interpolated(const cv::Mat& image, const Eigen::Vector2d& px);

}  // namespace hexcal
