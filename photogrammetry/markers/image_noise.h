#pragma once

#include <array>
#include <opencv2/core/mat.hpp>

namespace hexcal {

/// Variance of pixel noise over the encoded value, both as shares of full scale.
class NoiseModel {
 public:
  [[nodiscard]] double variance(double encoded) const;

 private:
  friend NoiseModel estimate_noise(const cv::Mat& grey, const cv::Rect& region);
  static constexpr int kLevels = 9;
  std::array<double, kLevels> at_level_{};  // at encoded 0, 1/8, ..., 1
};

/// From the quietest windows of 8 x 8 pixels at each level of brightness, after taking off a plane (so that
/// it holds for uncorrelated noise; JPEG takes noise out of flat areas, and edges are noisier than this
/// says). At least the variance of rounding.
[[nodiscard]] NoiseModel estimate_noise(const cv::Mat& grey, const cv::Rect& region);

/// Value of a pixel as a share of full scale.
[[nodiscard]] double full_scale(const cv::Mat& grey);

}  // namespace hexcal
