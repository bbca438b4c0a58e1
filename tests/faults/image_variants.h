#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "tools/synthetic/jpeg_file.h"

namespace hexcal {

/// Pixels of a JPEG's bytes, CV_8UC3.
[[nodiscard]] cv::Mat pixels_of(const std::string& jpeg);

/// Bytes of a picture in the format of an extension (".png", ".tif", ...), as OpenCV writes it with these
/// parameters of its own.
[[nodiscard]] std::string encoded(const cv::Mat& pixels, const std::string& extension,
                                  const std::vector<int>& parameters = {});

/// sRGB values of 8 bit as 16 bit of the same encoding.
[[nodiscard]] cv::Mat sixteen_bit(const cv::Mat& pixels);

/// An uncompressed DNG (Adobe DNG 1.4): the light of an sRGB picture through a mosaic of red, green, green
/// and blue.
[[nodiscard]] std::string dng_of(const cv::Mat& pixels);

/// The same pixels as a JPEG with other EXIF.
[[nodiscard]] std::string jpeg_with_tags(const cv::Mat& pixels, const PhotographTags& tags);

}  // namespace hexcal
