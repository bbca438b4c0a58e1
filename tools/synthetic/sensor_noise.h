#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "tools/synthetic/random_source.h"
#include "tools/synthetic/render.h"

namespace hexcal {

/// A sensor's noise (SensorOptions) as a function of the pixel and a seed: the same for any order of pixels.
class SensorNoise {
 public:
  SensorNoise(const SensorOptions& options, std::uint64_t seed);

  /// The random bits of a pixel, which serve its three channels.
  [[nodiscard]] std::uint64_t random(int x, int y) const {
    return mixed_bits(key_ ^ (static_cast<std::uint64_t>(y) << 32U | static_cast<std::uint64_t>(x)));
  }
  /// Light with noise, not clipped.
  [[nodiscard]] float added(float light, std::uint64_t random, std::size_t channel) const {
    return light + std::sqrt(shot_ * light + read_) * quantiles_[random >> (12 * channel) & (kQuantiles - 1)];
  }

 private:
  static constexpr int kQuantiles = 4096;
  static const std::vector<float>& normal_quantiles();

  const std::vector<float>& quantiles_;
  float shot_;
  float read_;
  std::uint64_t key_;
};

}  // namespace hexcal
