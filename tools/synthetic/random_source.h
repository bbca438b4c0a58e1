#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace hexcal {

/// Bijective mix of 64 bits (Steele et al. 2014, SplitMix64's finaliser): a random number for a counter.
[[nodiscard]] constexpr std::uint64_t mixed_bits(std::uint64_t z) {
  z += 0x9E3779B97F4A7C15ULL;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31);
}

/// Seeded generator whose numbers do not depend on the standard library. Streams of one seed are independent,
/// so that adding draws to one part of a scene leaves the others alone.
class RandomSource {
 public:
  explicit RandomSource(std::uint64_t seed, std::uint64_t stream = 0)
      : state_(mixed_bits(seed ^ mixed_bits(stream + 0x5851F42D4C957F2DULL))) {}

  std::uint64_t bits() { return mixed_bits(state_++); }
  /// In [low, high).
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(bits() >> 11) * 0x1.0p-53;
  }
  /// Mean 0, standard deviation 1 (Box and Muller 1958).
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform(0, 1)));
    return radius * std::cos(uniform(0, 2 * std::numbers::pi));
  }

 private:
  std::uint64_t state_;
};

}  // namespace hexcal
