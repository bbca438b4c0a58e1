#include "tools/io/csv_dialect.h"

#include <algorithm>
#include <cstdint>

#include "tools/io/scalar_text.h"

namespace hexcal {
namespace {

void append_utf8(std::string& out, std::uint32_t code) {
  const auto tail = [&out, code](int shift) { out += static_cast<char>(0x80 | ((code >> shift) & 0x3F)); };
  if (code < 0x80) {
    out += static_cast<char>(code);
  } else if (code < 0x800) {
    out += static_cast<char>(0xC0 | (code >> 6));
    tail(0);
  } else if (code < 0x10000) {
    out += static_cast<char>(0xE0 | (code >> 12));
    tail(6);
    tail(0);
  } else {
    out += static_cast<char>(0xF0 | (code >> 18));
    tail(12);
    tail(6);
    tail(0);
  }
}

std::string utf8_from_utf16(std::string_view text) {
  const bool little = text[0] == '\xFF';
  const auto unit = [&](std::size_t i) {
    const auto first = static_cast<unsigned char>(text[i]);
    const auto second = static_cast<unsigned char>(text[i + 1]);
    return static_cast<std::uint32_t>(little ? first | (second << 8) : (first << 8) | second);
  };
  constexpr std::uint32_t kReplacement = 0xFFFD;
  std::string out;
  out.reserve(text.size() / 2);
  for (std::size_t i = 2; i + 1 < text.size(); i += 2) {
    std::uint32_t code = unit(i);
    if (code >= 0xD800 && code < 0xDC00 && i + 3 < text.size() && (unit(i + 2) & 0xFC00) == 0xDC00) {
      code = 0x10000 + ((code - 0xD800) << 10) + (unit(i + 2) - 0xDC00);
      i += 2;
    } else if (code >= 0xD800 && code < 0xE000) {
      code = kReplacement;
    }
    append_utf8(out, code);
  }
  return out;
}

}  // namespace

bool begins_as_utf16(std::string_view text) {
  return text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF");
}

std::string csv_as_utf8(std::string text) {
  if (begins_as_utf16(text)) text = utf8_from_utf16(text);
  if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
  if (text.find('\n') == std::string::npos) std::replace(text.begin(), text.end(), '\r', '\n');
  return text;
}

char csv_separator(std::string_view header) {
  char best = ',';
  std::size_t most = 0;
  for (const char separator : {',', ';', '\t'}) {
    std::size_t count = 0;
    bool quoted = false;
    for (const char c : header) {
      if (c == '"') quoted = !quoted;
      if (c == separator && !quoted) ++count;
    }
    if (count <= most) continue;
    most = count;
    best = separator;
  }
  return best;
}

std::optional<double> csv_number(std::string_view field, char separator) {
  const std::size_t comma = separator == ',' ? std::string_view::npos : field.find(',');
  if (comma == std::string_view::npos) return number_from_text(field);
  if (field.find('.') != std::string_view::npos) return std::nullopt;  // which of the two it is nobody knows
  std::string with_point(field);
  with_point[comma] = '.';
  return number_from_text(with_point);
}

}  // namespace hexcal
