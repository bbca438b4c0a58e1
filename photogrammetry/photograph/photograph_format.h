#pragma once

#include <filesystem>
#include <string>

namespace hexcal {

/// The formats that are read, by the ending of the file's name in any case: jpg, tif, png, bmp, heic; RAW by
/// LibRaw: nef, dng, cr2, arw, raf (of sensors with a Bayer mosaic).
enum class PhotographFormat { none, jpeg, tiff, png, bmp, heif, nef, dng, other_raw };

[[nodiscard]] PhotographFormat photograph_format(const std::filesystem::path& path);

[[nodiscard]] constexpr bool is_raw(PhotographFormat format) {
  return format == PhotographFormat::nef || format == PhotographFormat::dng ||
         format == PhotographFormat::other_raw;
}

/// The endings that are read, for messages: "jpg, jpeg, png, ...".
[[nodiscard]] const std::string& photograph_endings();

/// What to do with a picture in a format that is not read ("CR3 is not read: save it as 16-bit TIFF or
/// JPEG"); empty for files that are no pictures, and for those that are read.
[[nodiscard]] std::string unread_format_advice(const std::filesystem::path& path);

}  // namespace hexcal
