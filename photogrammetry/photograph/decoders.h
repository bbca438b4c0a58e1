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

/// Luma of a HEIC photograph (HEVC in HEIF, as phones save it), 8 bit.
[[nodiscard]] DecodedImage decode_heif_luma(std::string_view bytes);

/// Size and EXIF (as the TIFF that it is) of a HEIC photograph; 0 and empty where there is none.
struct HeifHead {
  int width_px = 0;
  int height_px = 0;
  std::string exif;
};
[[nodiscard]] HeifHead read_heif_head(std::string_view bytes);

/// Green of the sensor's mosaic in linear light (16 bit), bilinear where it was not sampled, without white
/// balance, curve, brightening or rotation, cropped as the camera crops its JPEGs: NEF, DNG, CR2, ARW, RAF.
[[nodiscard]] DecodedImage decode_raw_green(std::string_view bytes);

/// The part of a RAW file's `shown` pixels that the camera's own JPEG has, centred: the size of the file's
/// preview where that is a whole one (at most 64 px smaller), or what is known of the body; else all.
[[nodiscard]] cv::Rect jpeg_crop(const std::string& make, const std::string& model, const cv::Size& preview,
                                 const cv::Size& shown);

/// PNG, TIFF and BMP, 8 or 16 bit; colour becomes luma. Of 16 bit the tone curve is judged (linear_tone.h).
[[nodiscard]] DecodedImage decode_raster(std::string_view bytes);

/// EXIF and maker notes of any file that is decoded; sizes are 0 if the file has none.
[[nodiscard]] PhotographInfo read_exif(std::string_view bytes);

}  // namespace hexcal
