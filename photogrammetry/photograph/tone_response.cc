#include "photogrammetry/photograph/tone_response.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace hexcal {
namespace {

constexpr double kToeSlope = 12.92;
constexpr double kToeEnd = 0.0031308;

double srgb_encode(double light) {
  return light <= kToeEnd ? kToeSlope * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
}

double srgb_decode(double encoded) {
  return encoded <= kToeSlope * kToeEnd ? encoded / kToeSlope : std::pow((encoded + 0.055) / 1.055, 2.4);
}

// sRGB over the square root of light, where the curve is nearly straight.
constexpr int kSteps = 2048;
constexpr double kMaxRoot = 1.5;

const std::array<double, kSteps + 2>& srgb_over_root() {
  static const std::array<double, kSteps + 2> table = [] {
    std::array<double, kSteps + 2> t{};
    for (int i = 0; i < kSteps + 2; ++i) {
      const double root = i * kMaxRoot / kSteps;
      t[static_cast<std::size_t>(i)] = srgb_encode(root * root);
    }
    return t;
  }();
  return table;
}

struct Nominal {
  double value, slope;
};

Nominal nominal_encode(ToneCurve curve, double light) {
  if (curve == ToneCurve::linear) return {light, 1};
  if (light <= kToeEnd) return {kToeSlope * light, kToeSlope};
  static const double* const table = srgb_over_root().data();
  const double root = std::min(std::sqrt(light), kMaxRoot);
  const double at = root * (kSteps / kMaxRoot);
  const auto i = static_cast<std::size_t>(at);
  const double step = table[i + 1] - table[i];
  return {table[i] + (at - static_cast<double>(i)) * step, step * (kSteps / kMaxRoot) / (2 * root)};
}

}  // namespace

ToneResponse::Encoded ToneResponse::encode(double light) const {
  const auto [e, slope] = nominal_encode(nominal_, light);
  const double q1 = e * (1 - e);
  const double q2 = q1 * (1 - 2 * e);
  return {e + first_ * q1 + second_ * q2, slope * (1 + first_ * (1 - 2 * e) + second_ * (1 - 6 * q1)), q1,
          q2};
}

double ToneResponse::decode(double encoded) const {
  double e = encoded;
  for (int i = 0; i < 20; ++i) {
    const double q1 = e * (1 - e);
    const double excess = e + first_ * q1 + second_ * q1 * (1 - 2 * e) - encoded;
    e -= excess / std::max(1 + first_ * (1 - 2 * e) + second_ * (1 - 6 * q1), 0.1);
    if (std::abs(excess) < 1e-12) break;
  }
  return nominal_ == ToneCurve::linear ? e : srgb_decode(e);
}

}  // namespace hexcal
