#include <opencv2/imgcodecs.hpp>

#include "photogrammetry/photograph/decoders.h"

namespace hexcal {
namespace {

std::uint32_t big_endian_32(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = at; i < at + 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[i]);
  return value;
}

// OpenCV fills what is missing of a PNG with black and only prints a warning.
bool is_cut_png(std::string_view bytes) {
  return bytes.size() < 45 || bytes.substr(bytes.size() - 8, 4) != "IEND";
}

}  // namespace

DecodedImage decode_raster(std::string_view bytes) {
  DecodedImage image;
  if (bytes.substr(1, 3) == "PNG") {
    if (is_cut_png(bytes)) {
      image.status = PhotographStatus::truncated;
      image.reason = "the PNG ends too early";
      return image;
    }
    const std::uint32_t width = big_endian_32(bytes, 16);
    const std::uint32_t height = big_endian_32(bytes, 20);
    if (static_cast<long long>(width) * height > kMaxPixels) {
      image.status = PhotographStatus::too_large;
      image.reason = std::to_string(width) + " x " + std::to_string(height) + " pixels";
      return image;
    }
  }
  try {
    const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data()));
    image.grey =
        cv::imdecode(buffer, cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception& error) {
    image.reason = error.err;
    return image;
  }
  if (image.grey.empty() || (image.grey.type() != CV_8UC1 && image.grey.type() != CV_16UC1)) {
    image.grey.release();
    image.reason = "no image of 8 or 16 bit that can be decoded";
    return image;
  }
  image.status = PhotographStatus::ok;
  return image;
}

}  // namespace hexcal
