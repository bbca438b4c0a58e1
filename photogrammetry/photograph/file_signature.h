#pragma once

#include <string_view>

namespace hexcal {

/// Families of files by their first bytes. NEF, DNG and TIFF are one.
enum class FileSignature { other, jpeg, png, tiff };

/// The decoders' libraries know dozens of other formats by their content; hexcal never lets them see one.
[[nodiscard]] inline FileSignature file_signature(std::string_view bytes) {
  using namespace std::string_view_literals;
  if (bytes.starts_with("\xFF\xD8\xFF"sv)) return FileSignature::jpeg;
  if (bytes.starts_with("\x89PNG\r\n\x1A\n"sv)) return FileSignature::png;
  if (bytes.starts_with("II*\0"sv) || bytes.starts_with("MM\0*"sv)) return FileSignature::tiff;
  return FileSignature::other;
}

}  // namespace hexcal
