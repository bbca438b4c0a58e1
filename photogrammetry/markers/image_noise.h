#pragma once

#include <array>
#include <opencv2/core/mat.hpp>

namespace hexcal {

/// Variance of pixel noise over the encoded value, both as shares of full scale.
class NoiseModel {
 public:
  [[nodiscard]] double variance(double encoded) const;

  /// Raw values at and beyond which a pixel says only that there was so much light or more (`white`), or so
  /// little or less (`black`).
  [[nodiscard]] int black_clip() const { return black_clip_; }
  [[nodiscard]] int white_clip() const { return white_clip_; }

 private:
  friend NoiseModel estimate_noise(const cv::Mat& grey, const cv::Rect& region);
  static constexpr int kLevels = 9;
  std::array<double, kLevels> at_level_{};  // at encoded 0, 1/8, ..., 1
  int black_clip_ = 0, white_clip_ = 255;
};

/// From the quietest windows of 8 x 8 pixels at each level of brightness, after taking off a plane (so that
/// it holds for uncorrelated noise; JPEG takes noise out of flat areas, and edges are noisier than this
/// says). At least the variance of rounding. Cameras clip at 255 or a little below (a picture profile, a
/// range that ends at 235 or 253): where values heap at the top or the bottom of what occurs, the heap is
/// clipped.
[[nodiscard]] NoiseModel estimate_noise(const cv::Mat& grey, const cv::Rect& region);

/// Value of a pixel as a share of full scale.
[[nodiscard]] double full_scale(const cv::Mat& grey);

}  // namespace hexcal
