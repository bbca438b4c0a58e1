#include "kinematics/interval.h"

namespace hexcal {
namespace {

constexpr double kHalfPi = 1.5707963267948966;

}  // namespace

Interval cosine(const Interval& angle) {
  const Interval a = Interval::around(std::cos(angle.lower), 4);
  const Interval b = Interval::around(std::cos(angle.upper), 4);
  Interval result{std::min(a.lower, b.lower), std::max(a.upper, b.upper)};
  // Extremes at the multiples of pi, met with a margin for pi's own rounding.
  for (int n = -4; n <= 4; ++n) {
    const double extreme = 2 * kHalfPi * n;
    if (angle.lower - 1e-14 <= extreme && extreme <= angle.upper + 1e-14) {
      if (n % 2 == 0) result.upper = 1;
      if (n % 2 != 0) result.lower = -1;
    }
  }
  return intersection(result, {-1, 1});
}

Interval sine(const Interval& angle) { return cosine(angle - Interval::around(kHalfPi, 1)); }

}  // namespace hexcal
