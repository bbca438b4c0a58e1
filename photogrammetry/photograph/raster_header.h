#pragma once

#include <string>
#include <string_view>

#include "photogrammetry/photograph/photograph.h"

namespace hexcal {

/// What the head of a PNG, TIFF or BMP claims, judged before a decoder believes it.
struct RasterHeader {
  PhotographStatus status = PhotographStatus::unreadable;
  std::string reason;  ///< why status is not ok, in words
  long long width_px = 0;
  long long height_px = 0;
};

/// Only what hexcal measures is ok: 8 or 16 bit a sample, at most four samples a pixel, a size that
/// `size_fault` accepts, and strips or tiles no larger than the picture.
[[nodiscard]] RasterHeader read_png_header(std::string_view bytes);
[[nodiscard]] RasterHeader read_tiff_header(std::string_view bytes);
[[nodiscard]] RasterHeader read_bmp_header(std::string_view bytes);

/// Why a picture of this size in a file of so many bytes is not decoded: more pixels than cameras have, or
/// more than any photograph packs into the file. Empty if it may be.
[[nodiscard]] std::string size_fault(long long width_px, long long height_px, std::size_t file_bytes);

}  // namespace hexcal
