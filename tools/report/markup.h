#pragma once

#include <string>
#include <string_view>

namespace hexcal {

/// Text without control characters (tab and line break stay), bytes that are no UTF-8 replaced by U+FFFD.
[[nodiscard]] std::string clean_text(std::string_view text);

/// clean_text() made safe as content or quoted attribute of HTML and XML: & < > " ' as entities. Everything
/// that comes from a user's file passes here.
[[nodiscard]] std::string markup_escaped(std::string_view text);

/// JSON text made safe inside a <script> element: no `<` is left.
[[nodiscard]] std::string script_escaped(std::string_view json);

/// A number with as many digits as `step` shows, with a true minus sign; "-0" is "0".
[[nodiscard]] std::string number_text(double value, double step);

/// A number with `digits` significant digits in fixed notation, with a true minus sign.
[[nodiscard]] std::string significant_text(double value, int digits);

/// Words of a program as words of a person: "no_markers: none seen" is "no markers: none seen".
[[nodiscard]] std::string status_text(std::string_view status);

/// A sentence: begins with a capital, unless that would change a name, and ends with a full stop.
[[nodiscard]] std::string sentence(std::string words);

/// "99.5" for a fall from 200 to 1: per cent by which `after` is less than `before`, with as many digits as
/// it takes to tell it from 100.
[[nodiscard]] std::string less_by_text(double before, double after);

}  // namespace hexcal
