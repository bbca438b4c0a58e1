#pragma once

#include <string>
#include <string_view>

// What a number may be, by the name of its column, key or flag: the one range check of every file and flag.
// The limits are far beyond any machine or photograph, and so far within those of double that no square or
// quotient of them overflows.

namespace hexcal {

/// Checks a finite number and returns it. `name` is that of a column, a key or a flag; its ending tells the
/// kind: _mm, _deg and _px at most 1e6 in size, all others 1e12; a sigma is 0 or at least 1e-15; a scale
/// (_per_unit) at least 1e-9 in size. What is below 1e-30 counts as zero. Otherwise `fault` is set to what
/// was found and wanted.
[[nodiscard]] double ranged_number(std::string_view name, double value, std::string& fault);

}  // namespace hexcal
