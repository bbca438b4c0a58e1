#include "photogrammetry/markers/normal_distribution.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace hexcal {
namespace {

constexpr double kReach = 6;
constexpr int kStepsPerUnit = 32;
constexpr std::size_t kEntries = static_cast<std::size_t>(2 * kReach * kStepsPerUnit) + 1;

const std::array<NormalValue, kEntries>& table() {
  static const std::array<NormalValue, kEntries> entries = [] {
    std::array<NormalValue, kEntries> t{};
    for (std::size_t i = 0; i < kEntries; ++i) {
      const double x = static_cast<double>(i) / kStepsPerUnit - kReach;
      t[i] = {0.5 * std::erfc(-x * std::numbers::sqrt2 / 2),
              std::exp(-0.5 * x * x) * std::numbers::inv_sqrtpi / std::numbers::sqrt2};
    }
    return t;
  }();
  return entries;
}

// phi(a) phi(b) sum of rho^(n+1) / (n+1)! He_n(a) He_n(b).
double tetrachoric_series(double a, double b, double rho) {
  double he_a = 1;
  double he_b = 1;
  double he_a_before = 0;
  double he_b_before = 0;
  double power = rho;
  double sum = 0;
  for (int n = 0; n < 8; ++n) {
    sum += power * he_a * he_b;
    power *= rho / (n + 2);
    const double next_a = a * he_a - n * he_a_before;
    const double next_b = b * he_b - n * he_b_before;
    he_a_before = he_a;
    he_b_before = he_b;
    he_a = next_a;
    he_b = next_b;
  }
  return sum;
}

double plackett_quadrature(double a, double b, double rho) {
  // Gauss-Legendre, ten points, symmetric pairs.
  constexpr std::array<double, 5> kNode{0.1488743389816312, 0.4333953941292472, 0.6794095682990244,
                                        0.8650633666889845, 0.9739065285171717};
  constexpr std::array<double, 5> kWeight{0.2955242247147529, 0.2692667193099963, 0.2190863625159820,
                                          0.1494513491505806, 0.0666713443086881};
  const double half = 0.5 * std::asin(rho);
  const double squares = 0.5 * (a * a + b * b);
  double sum = 0;
  for (std::size_t i = 0; i < kNode.size(); ++i) {
    for (const double node : {-kNode[i], kNode[i]}) {
      const double s = std::sin(half * (1 + node));
      sum += kWeight[i] * std::exp((a * b * s - squares) / (1 - s * s));
    }
  }
  return sum * half / (2 * std::numbers::pi);
}

}  // namespace

NormalValue standard_normal(double x) {
  if (!(x > -kReach)) return {0, 0};
  if (x >= kReach) return {1, 0};
  static const NormalValue* const entries = table().data();
  const int at = static_cast<int>((x + kReach) * kStepsPerUnit + 0.5);
  const double x0 = at * (1.0 / kStepsPerUnit) - kReach;
  const double h = x - x0;
  const NormalValue& e = entries[static_cast<std::size_t>(at)];
  // Taylor series of third order about the nearest entry.
  const double second = x0 * x0 - 1;
  return {e.cdf + e.density * h * (1 - h * (0.5 * x0 - h * second / 6)),
          e.density * (1 - h * (x0 - h * (0.5 * second - h * x0 * (x0 * x0 - 3) / 6)))};
}

double bivariate_normal_cdf(double a, double b, double rho, const NormalValue& at_a,
                            const NormalValue& at_b) {
  const double independent = at_a.cdf * at_b.cdf;
  if (std::abs(rho) < 1e-7) return independent;
  if (std::abs(rho) < 0.3) {
    return independent + at_a.density * at_b.density * tetrachoric_series(a, b, rho);
  }
  return std::clamp(independent + plackett_quadrature(a, b, rho), 0.0, std::min(at_a.cdf, at_b.cdf));
}

}  // namespace hexcal
