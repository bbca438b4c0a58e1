#pragma once

#include <optional>
#include <string>
#include <string_view>

// What spreadsheets make of a CSV table, read back.

namespace hexcal {

/// UTF-16 with its byte order mark becomes UTF-8; UTF-8's mark goes; line ends that are carriage returns
/// alone become line feeds. Other text is left as it is.
[[nodiscard]] std::string csv_as_utf8(std::string text);
/// True where csv_as_utf8 would recode the text that begins so.
[[nodiscard]] bool begins_as_utf16(std::string_view text);

/// What stands between the fields, by the header line: the one of semicolon, tab and comma that occurs most
/// outside of quotes; a comma if none does.
[[nodiscard]] char csv_separator(std::string_view header);

/// A finite number. With another separator than a comma, one comma is a decimal point.
[[nodiscard]] std::optional<double> csv_number(std::string_view field, char separator);

}  // namespace hexcal
