#pragma once

#include <string_view>

namespace hexcal {

/// Families of files by their first bytes. NEF, DNG, CR2, ARW and TIFF are one.
enum class FileSignature { other, jpeg, png, tiff, bmp, heif, raf };

/// The decoders' libraries know dozens of other formats by their content; hexcal never lets them see one.
[[nodiscard]] inline FileSignature file_signature(std::string_view bytes) {
  using namespace std::string_view_literals;
  if (bytes.starts_with("\xFF\xD8\xFF"sv)) return FileSignature::jpeg;
  if (bytes.starts_with("\x89PNG\r\n\x1A\n"sv)) return FileSignature::png;
  if (bytes.starts_with("II*\0"sv) || bytes.starts_with("MM\0*"sv)) return FileSignature::tiff;
  if (bytes.starts_with("FUJIFILMCCD-RAW "sv)) return FileSignature::raf;
  if (bytes.starts_with("BM"sv)) return FileSignature::bmp;
  if (bytes.size() > 12 && bytes.substr(4, 4) == "ftyp"sv) {
    // HEVC-coded still pictures (ISO/IEC 23008-12); the general brand covers AV1 as well, which libheif
    // refuses.
    for (const std::string_view brand : {"heic"sv, "heix"sv, "heim"sv, "heis"sv, "mif1"sv}) {
      if (bytes.substr(8, 4) == brand) return FileSignature::heif;
    }
  }
  return FileSignature::other;
}

}  // namespace hexcal
