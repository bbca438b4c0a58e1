#pragma once

#include <string>
#include <string_view>

#include "tools/io/number_text.h"

namespace hexcal {

/// Text without control characters (tab and line break stay), bytes that are no UTF-8 replaced by U+FFFD.
[[nodiscard]] std::string clean_text(std::string_view text);

/// clean_text() made safe as content or quoted attribute of HTML and XML: & < > " ' as entities. Everything
/// that comes from a user's file passes here.
[[nodiscard]] std::string markup_escaped(std::string_view text);

/// JSON text made safe inside a <script> element: no `<` is left.
[[nodiscard]] std::string script_escaped(std::string_view json);

/// Words of a program as words of a person: "no_markers: none seen" is "no markers: none seen".
[[nodiscard]] std::string status_text(std::string_view status);

/// A sentence: begins with a capital, unless that would change a name, and ends with a full stop.
[[nodiscard]] std::string sentence(std::string words);

}  // namespace hexcal
