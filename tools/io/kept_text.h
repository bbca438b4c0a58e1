#pragma once

#include <optional>
#include <string>
#include <string_view>

// What hexcal keeps for itself (observations of a photograph, a finished measurement, a calibration) carries
// its own SHA-256, so that a byte that was changed since is noticed and the answer is made anew.

namespace hexcal {

/// Text behind a comment line with its SHA-256.
[[nodiscard]] std::string sealed_text(std::string_view text);
/// The text that was sealed; nothing if a byte is another one.
[[nodiscard]] std::optional<std::string_view> unsealed_text(std::string_view sealed);

/// The same of a JSON value, as the member `kept` of an object, beside `sha256`.
[[nodiscard]] std::string sealed_json(std::string_view json);
[[nodiscard]] std::optional<std::string_view> unsealed_json(std::string_view sealed);

}  // namespace hexcal
