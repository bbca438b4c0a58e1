#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace hexcal {

static_assert(std::numeric_limits<double>::is_iec559, "the outward rounding below is that of IEEE 754");

/// A closed interval of real numbers. Every operation encloses the exact result: it is computed in
/// round-to-nearest and moved outwards by at least one unit in the last place (Rump, Zimmermann, Boldo &
/// Melquiond, BIT 49, 2009, alg. 2), so that neither the rounding mode nor the optimiser matters (-ffast-math
/// would).
struct Interval {
  double lower = 0;
  double upper = 0;

  Interval() = default;
  Interval(double value) : lower(value), upper(value) {}  // NOLINT: numbers are intervals
  Interval(double low, double high) : lower(low), upper(high) {}

  /// A double that may stand for any real number within `ulps` units in its last place.
  [[nodiscard]] static Interval around(double value, double ulps) {
    const double radius = ulps * std::numeric_limits<double>::epsilon() * std::abs(value);
    return {below(value - radius), above(value + radius)};
  }

  [[nodiscard]] double middle() const { return lower + 0.5 * (upper - lower); }
  [[nodiscard]] double width() const { return upper - lower; }
  [[nodiscard]] bool contains(double value) const { return lower <= value && value <= upper; }
  /// Strictly inside.
  [[nodiscard]] bool inside(const Interval& other) const {
    return lower > other.lower && upper < other.upper;
  }
  [[nodiscard]] bool within(const Interval& other) const {
    return lower >= other.lower && upper <= other.upper;
  }
  [[nodiscard]] bool meets(const Interval& other) const {
    return lower <= other.upper && other.lower <= upper;
  }

  static constexpr double kHalfUlp = 0x1.0000000000001p-53;
  static constexpr double kTiny = 0x1p-1074;
  [[nodiscard]] static double below(double x) { return x - (kHalfUlp * std::abs(x) + kTiny); }
  [[nodiscard]] static double above(double x) { return x + (kHalfUlp * std::abs(x) + kTiny); }
};

[[nodiscard]] inline Interval operator-(const Interval& a) { return {-a.upper, -a.lower}; }
[[nodiscard]] inline Interval operator+(const Interval& a, const Interval& b) {
  return {Interval::below(a.lower + b.lower), Interval::above(a.upper + b.upper)};
}
[[nodiscard]] inline Interval operator-(const Interval& a, const Interval& b) {
  return {Interval::below(a.lower - b.upper), Interval::above(a.upper - b.lower)};
}
[[nodiscard]] inline Interval operator*(const Interval& a, const Interval& b) {
  const double p = a.lower * b.lower;
  const double q = a.lower * b.upper;
  const double r = a.upper * b.lower;
  const double s = a.upper * b.upper;
  return {Interval::below(std::min(std::min(p, q), std::min(r, s))),
          Interval::above(std::max(std::max(p, q), std::max(r, s)))};
}
[[nodiscard]] inline Interval operator*(double a, const Interval& b) {
  const double p = a * b.lower;
  const double q = a * b.upper;
  return {Interval::below(std::min(p, q)), Interval::above(std::max(p, q))};
}
/// The divisor must not contain zero.
[[nodiscard]] inline Interval operator/(const Interval& a, const Interval& b) {
  const double p = a.lower / b.lower;
  const double q = a.lower / b.upper;
  const double r = a.upper / b.lower;
  const double s = a.upper / b.upper;
  return {Interval::below(std::min(std::min(p, q), std::min(r, s))),
          Interval::above(std::max(std::max(p, q), std::max(r, s)))};
}
inline Interval& operator+=(Interval& a, const Interval& b) { return a = a + b; }
inline Interval& operator-=(Interval& a, const Interval& b) { return a = a - b; }

[[nodiscard]] inline Interval square(const Interval& a) {
  const double l = a.lower * a.lower;
  const double u = a.upper * a.upper;
  const double low = a.contains(0) ? 0 : Interval::below(std::min(l, u));
  return {std::max(0.0, low), Interval::above(std::max(l, u))};
}

/// Empty when they do not meet: then lower > upper.
[[nodiscard]] inline Interval intersection(const Interval& a, const Interval& b) {
  return {std::max(a.lower, b.lower), std::min(a.upper, b.upper)};
}

/// Cosine and sine of angles within a turn of zero. The C library is trusted to four units in the last place.
[[nodiscard]] Interval cosine(const Interval& angle);
[[nodiscard]] Interval sine(const Interval& angle);

}  // namespace hexcal
