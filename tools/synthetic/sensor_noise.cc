#include "tools/synthetic/sensor_noise.h"

#include <algorithm>
#include <numbers>

namespace hexcal {

// Quantiles of the unit normal distribution, scaled to unit variance: a random index is a normal number.
const std::vector<float>& SensorNoise::normal_quantiles() {
  static const std::vector<float> quantiles = [] {
    std::vector<double> z(kQuantiles);
    double square = 0;
    for (int i = 0; i < kQuantiles; ++i) {
      const double p = (i + 0.5) / kQuantiles;
      double x = 0;
      for (int iteration = 0; iteration < 60; ++iteration) {
        const double error = 0.5 * std::erfc(-x / std::sqrt(2.0)) - p;
        const double step = error / (std::exp(-0.5 * x * x) / std::sqrt(2 * std::numbers::pi));
        x -= std::clamp(step, -0.5, 0.5);
      }
      z[static_cast<std::size_t>(i)] = x;
      square += x * x;
    }
    std::vector<float> scaled(kQuantiles);
    for (std::size_t i = 0; i < scaled.size(); ++i) {
      scaled[i] = static_cast<float>(z[i] / std::sqrt(square / kQuantiles));
    }
    return scaled;
  }();
  return quantiles;
}

SensorNoise::SensorNoise(const SensorOptions& options, std::uint64_t seed)
    : quantiles_(normal_quantiles()),
      shot_(static_cast<float>(options.full_well_electrons > 0 ? 1 / options.full_well_electrons : 0)),
      read_(static_cast<float>(options.read_noise * options.read_noise)),
      key_(mixed_bits(seed ^ 0xD1CEULL)) {}

}  // namespace hexcal
