#pragma once

#include <string>
#include <string_view>

namespace hexcal {

/// A text on one line that no terminal takes for a command, for names of files, ids and what cameras write
/// into photographs: control characters (line breaks and escapes too; C1 as well, alone or as UTF-8) become
/// `\xNN`. All other bytes stay.
[[nodiscard]] std::string printable_text(std::string_view text);

/// The same of a text of lines: line breaks and tabs stay.
[[nodiscard]] std::string printable_lines(std::string_view text);

}  // namespace hexcal
