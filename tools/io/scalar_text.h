#pragma once

#include <optional>
#include <string_view>

namespace hexcal {

/// The text without the blanks and carriage returns around it.
[[nodiscard]] std::string_view trimmed(std::string_view text);

/// A finite number if the whole text is one (a leading + is allowed, blanks are not), without regard to the
/// locale.
[[nodiscard]] std::optional<double> number_from_text(std::string_view text);

/// Marker ids as people write them in files and flags: `9`, or `0-9` with both ends; 0 to 1 000 000, a range
/// of 100 000 at most.
struct IdRange {
  int first = 0;
  int last = 0;
};
[[nodiscard]] std::optional<IdRange> id_range_from_text(std::string_view text);

/// One id alone.
[[nodiscard]] std::optional<int> id_from_text(std::string_view text);

}  // namespace hexcal
