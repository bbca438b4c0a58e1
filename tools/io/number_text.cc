#include "tools/io/number_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace hexcal {
namespace {

std::string with_true_minus(std::string text) {
  if (text.empty() || text[0] != '-') return text;
  if (text.find_first_of("123456789") == std::string::npos) return text.substr(1);
  return "\xE2\x88\x92" + text.substr(1);
}

}  // namespace

std::string number_text(double value, double step) {
  if (!std::isfinite(value)) return "\xE2\x80\x93";
  const int decimals = step > 0 ? std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 9) : 3;
  return with_true_minus(fmt::format("{:.{}f}", value, decimals));
}

std::string significant_text(double value, int digits) {
  if (!std::isfinite(value)) return "\xE2\x80\x93";
  if (value == 0) return "0";
  const int exponent = static_cast<int>(std::floor(std::log10(std::abs(value))));
  return with_true_minus(fmt::format("{:.{}f}", value, std::clamp(digits - 1 - exponent, 0, 9)));
}

std::string less_by_text(double before, double after) {
  const double left = before > 0 ? 100 * after / before : 100;
  const int decimals =
      left > 0 && left < 0.95 ? std::min(6, static_cast<int>(std::ceil(-std::log10(left)))) + 1 : 1;
  return number_text(100 - left, std::pow(10.0, -decimals));
}

}  // namespace hexcal
