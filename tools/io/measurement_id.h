#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

// The files of results/ that one measurement wrote name it in their second comment line
// ("# measurement 0123456789abcdef"), so that a table of another one beside them is noticed: after
// `measure -o elsewhere`, after a copy by hand.

namespace hexcal {

/// Name of a measurement: the same for the same content.
[[nodiscard]] std::string measurement_id(std::string_view content);
[[nodiscard]] std::string measurement_line(std::string_view id);

/// The measurement that a file says it is of; nothing where it says none, or cannot be read.
[[nodiscard]] std::optional<std::string> measurement_of(const std::filesystem::path& file);

/// The first of the other files that is of another measurement than `file`; nothing if all are of one, or
/// where neither says of which it is.
[[nodiscard]] std::optional<std::filesystem::path> of_another_measurement(
    const std::filesystem::path& file, const std::vector<std::filesystem::path>& others);

/// Throws InputError that names both files where one of `others` that exists is of another measurement.
void require_one_measurement(const std::filesystem::path& file,
                             const std::vector<std::filesystem::path>& others);

}  // namespace hexcal
