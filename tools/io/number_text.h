#pragma once

#include <string>

namespace hexcal {

/// A number with as many digits as `step` shows, with a true minus sign; "-0" is "0".
[[nodiscard]] std::string number_text(double value, double step);

/// A number with `digits` significant digits in fixed notation, with a true minus sign.
[[nodiscard]] std::string significant_text(double value, int digits);

/// "99.5" for a fall from 200 to 1: per cent by which `after` is less than `before`, with as many digits as
/// it takes to tell it from 100.
[[nodiscard]] std::string less_by_text(double before, double after);

}  // namespace hexcal
