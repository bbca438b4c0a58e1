#pragma once

#include <vector>

namespace hexcal {

/// 1, 2 or 5 times a power of ten, not above a positive `value`.
[[nodiscard]] double round_number_below(double value);

/// Round numbers along an axis: `step` is 1, 2 or 5 times a power of ten, `low` and `high` are multiples of
/// it.
struct AxisTicks {
  double low = 0;
  double high = 1;
  double step = 1;
  [[nodiscard]] std::vector<double> values() const;
};

/// About `wanted` steps that cover [low, high]; an empty or broken range is widened to one that can be drawn.
[[nodiscard]] AxisTicks axis_ticks(double low, double high, int wanted);

/// Ticks for fixed ends: round steps inside, ends as given.
[[nodiscard]] AxisTicks axis_ticks_within(double low, double high, int wanted);

}  // namespace hexcal
