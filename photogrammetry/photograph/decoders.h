#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <string_view>

#include "photogrammetry/photograph/photograph.h"

namespace hexcal {

/// What one decoder made of a file's bytes.
struct DecodedImage {
  PhotographStatus status = PhotographStatus::unreadable;
  std::string reason;
  cv::Mat grey;
  ToneCurve tone = ToneCurve::srgb;
};

/// Luma only, through libjpeg. Damaged data is `truncated`, with libjpeg's words.
[[nodiscard]] DecodedImage decode_jpeg_luma(std::string_view bytes);

/// Green of the sensor's mosaic in linear light (16 bit), bilinear where it was not sampled, without white
/// balance, curve, brightening or rotation: NEF, DNG and whatever else LibRaw reads.
[[nodiscard]] DecodedImage decode_raw_green(std::string_view bytes);

/// PNG and TIFF, 8 or 16 bit; colour becomes luma.
[[nodiscard]] DecodedImage decode_raster(std::string_view bytes);

/// EXIF and maker notes of a JPEG, PNG or TIFF; sizes are 0 if the file has none.
[[nodiscard]] PhotographInfo read_exif(std::string_view bytes);

}  // namespace hexcal
