#include "kinematics/geometry/printable_text.h"

#include <cstddef>

namespace hexcal {
namespace {

unsigned char byte_at(std::string_view text, std::size_t i) { return static_cast<unsigned char>(text[i]); }

// Bytes of the UTF-8 character that begins at `i`; 0 if none does.
std::size_t character_length(std::string_view text, std::size_t i) {
  const unsigned char first = byte_at(text, i);
  const std::size_t length = first < 0x80   ? 1
                             : first < 0xC2 ? 0
                             : first < 0xE0 ? 2
                             : first < 0xF0 ? 3
                             : first < 0xF5 ? 4
                                            : 0;
  if (length == 0 || i + length > text.size()) return 0;
  for (std::size_t k = 1; k < length; ++k)
    if ((byte_at(text, i + k) & 0xC0U) != 0x80U) return 0;
  return length;
}

std::string printable(std::string_view text, std::string_view allowed) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    const unsigned char byte = byte_at(text, i);
    std::size_t length = character_length(text, i);
    const bool control = byte < 0x20 || byte == 0x7F || (length == 0 && byte >= 0x80 && byte < 0xA0) ||
                         (length == 2 && byte == 0xC2 && byte_at(text, i + 1) < 0xA0);
    if (length == 0) length = 1;
    if (!control || allowed.find(text[i]) != std::string_view::npos) {
      out += text.substr(i, length);
    } else {
      for (std::size_t k = i; k < i + length; ++k) {
        out += "\\x";
        out += kDigits[byte_at(text, k) >> 4U];
        out += kDigits[byte_at(text, k) & 0xFU];
      }
    }
    i += length;
  }
  return out;
}

}  // namespace

std::string printable_text(std::string_view text) { return printable(text, ""); }
std::string printable_lines(std::string_view text) { return printable(text, "\n\t"); }

}  // namespace hexcal
