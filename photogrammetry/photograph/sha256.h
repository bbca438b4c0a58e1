#pragma once

#include <istream>
#include <string>
#include <string_view>

namespace hexcal {

/// SHA-256 (FIPS 180-4) in hexadecimal, 64 digits.
[[nodiscard]] std::string sha256_hex(std::string_view bytes);

/// Of what is left of a stream, read in pieces.
[[nodiscard]] std::string sha256_hex(std::istream& in);

}  // namespace hexcal
