#include "tools/report/axis_ticks.h"

#include <algorithm>
#include <cmath>

namespace hexcal {

double round_number_below(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  const double share = value / power;
  return power * (share >= 5 ? 5 : share >= 2 ? 2 : 1);
}
namespace {

// Not finer than a double can tell apart at this magnitude.
double drawable_span(double low, double high) {
  const double magnitude = std::max(std::abs(low), std::abs(high));
  return std::max(high - low, 1e-9 * magnitude);
}

double round_step(double span, int wanted) {
  const double raw = span / std::max(wanted, 1);
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double share = raw / power;
  return power * (share < 1.5 ? 1 : share < 3.5 ? 2 : share < 7.5 ? 5 : 10);
}

}  // namespace

std::vector<double> AxisTicks::values() const {
  std::vector<double> out;
  const double first = std::ceil(low / step - 1e-6);
  const double last = std::floor(high / step + 1e-6);
  for (double i = first; i <= last; i += 1) out.push_back(i * step);
  return out;
}

AxisTicks axis_ticks(double low, double high, int wanted) {
  if (!std::isfinite(low) || !std::isfinite(high) || high < low) return {0, 1, 0.5};
  if (high == low) {
    const double margin = low == 0 ? 1 : 0.1 * std::abs(low);
    low -= low == 0 ? 0 : margin;
    high += margin;
  }
  const double step = round_step(drawable_span(low, high), wanted);
  return {std::floor(low / step + 1e-6) * step, std::ceil(high / step - 1e-6) * step, step};
}

AxisTicks axis_ticks_within(double low, double high, int wanted) {
  if (!std::isfinite(low) || !std::isfinite(high) || high <= low) return axis_ticks(low, high, wanted);
  return {low, high, round_step(drawable_span(low, high), wanted)};
}

}  // namespace hexcal
