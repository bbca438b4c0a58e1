#include "tools/io/number_range.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace hexcal {
namespace {

constexpr double kLargestMeasure = 1e6;  // mm, deg, px: a kilometre, thousands of turns
constexpr double kLargest = 1e12;
constexpr double kLeastSigma = 1e-15;
constexpr double kLeastScale = 1e-9;
constexpr double kZero = 1e-30;

}  // namespace

double ranged_number(std::string_view name, double value, std::string& fault) {
  if (std::abs(value) < kZero && !name.ends_with("_per_unit")) return 0;
  const bool is_measure =
      std::ranges::any_of(std::initializer_list<std::string_view>{"_mm", "_deg", "_px", "-mm", "-deg", "-px"},
                          [name](std::string_view ending) { return name.ends_with(ending); });
  const double most = is_measure ? kLargestMeasure : kLargest;
  const bool is_sigma = name.starts_with("sigma") || name.find("_sigma") != std::string_view::npos;
  const double least = name.ends_with("_per_unit") ? kLeastScale : is_sigma && value != 0 ? kLeastSigma : 0;
  if (!(std::abs(value) <= most))
    fault = fmt::format("found {:g}, wanted at most {:g} in size", value, most);
  else if (is_sigma && value < 0)
    fault = fmt::format("found {:g}, wanted 0 or more", value);
  else if (std::abs(value) < least)
    fault = fmt::format("found {:g}, wanted at least {:g}{}", value, least, is_sigma ? ", or 0" : "");
  return value;
}

}  // namespace hexcal
