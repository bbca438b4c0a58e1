#include "tools/hexcal/printable_output.h"

#include <sys/types.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <string>
#include <string_view>

#include "kinematics/geometry/printable_text.h"

namespace hexcal {
namespace {

bool output_silent = false;

// Length of a colour (ESC [ digits m), of the erasing of a line (ESC [ K) or of a carriage return; 0 if none
// of them begins the text.
std::size_t own_sequence_length(std::string_view text) {
  if (text.starts_with('\r')) return 1;
  if (!text.starts_with("\x1b[")) return 0;
  std::size_t end = 2;
  while (end < text.size() && text[end] >= '0' && text[end] <= '9') ++end;
  return end < text.size() && (text[end] == 'm' || text[end] == 'K') ? end + 1 : 0;
}

std::string printable_for(std::string_view text, bool terminal) {
  std::string out;
  while (true) {
    const std::size_t mark = text.find(kOwnSequence);
    out += printable_lines(text.substr(0, mark));
    if (mark == std::string_view::npos) return out;
    text.remove_prefix(mark + 1);
    const std::size_t length = own_sequence_length(text);
    if (terminal) out += text.substr(0, length);
    text.remove_prefix(length);
  }
}

struct Stream {
  int descriptor;
  int error = 0;     // of the system, the first
  std::string held;  // beginning of a character whose rest is still to come
};

// Bytes at the end that are the beginning of a longer UTF-8 character.
std::size_t unfinished_bytes(std::string_view text) {
  for (std::size_t n = 1; n <= std::min<std::size_t>(3, text.size()); ++n) {
    const auto byte = static_cast<unsigned char>(text[text.size() - n]);
    if ((byte & 0xC0U) == 0x80U) continue;
    const std::size_t length = byte < 0xC2 ? 1 : byte < 0xE0 ? 2 : byte < 0xF0 ? 3 : byte < 0xF5 ? 4 : 1;
    return length > n ? n : 0;
  }
  return 0;
}

ssize_t write_printable(void* cookie, const char* bytes, std::size_t size) {
  Stream& stream = *static_cast<Stream*>(cookie);
  if (stream.descriptor == STDOUT_FILENO && output_silent) return static_cast<ssize_t>(size);
  std::string raw = stream.held + std::string(bytes, size);
  const std::size_t whole = raw.size() - unfinished_bytes(raw);
  stream.held = raw.substr(whole);
  raw.resize(whole);
  const std::string text = printable_for(raw, ::isatty(stream.descriptor) != 0);
  for (std::string_view left = text; !left.empty();) {
    const ssize_t count = ::write(stream.descriptor, left.data(), left.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      if (stream.error == 0) stream.error = count < 0 ? errno : EIO;
      return 0;
    }
    left.remove_prefix(static_cast<std::size_t>(count));
  }
  return static_cast<ssize_t>(size);
}

std::FILE* printable_stream(Stream& stream, std::FILE* plain) {
  const cookie_io_functions_t functions{nullptr, &write_printable, nullptr, nullptr};
  std::FILE* const printable = ::fopencookie(&stream, "w", functions);
  if (printable == nullptr) return plain;
  std::setvbuf(printable, nullptr,
               ::isatty(stream.descriptor) != 0 || stream.descriptor == STDERR_FILENO ? _IOLBF : _IOFBF,
               std::size_t{1} << 16);
  return printable;
}

Stream standard_output{STDOUT_FILENO, 0, {}};
Stream standard_error{STDERR_FILENO, 0, {}};

}  // namespace

void make_output_printable() {
  stdout = printable_stream(standard_output, stdout);
  stderr = printable_stream(standard_error, stderr);
}

void silence_output() { output_silent = true; }

int output_error() {
  const bool flushed = std::fflush(stdout) == 0;
  return standard_output.error != 0 ? standard_output.error : flushed ? 0 : errno;
}

}  // namespace hexcal
