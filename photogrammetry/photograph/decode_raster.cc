#include <opencv2/imgcodecs.hpp>

#include "photogrammetry/photograph/decoders.h"
#include "photogrammetry/photograph/file_signature.h"
#include "photogrammetry/photograph/linear_tone.h"
#include "photogrammetry/photograph/raster_header.h"

namespace hexcal {

DecodedImage decode_raster(std::string_view bytes) {
  DecodedImage image;
  const FileSignature signature = file_signature(bytes);
  RasterHeader header;
  if (signature == FileSignature::png) {
    header = read_png_header(bytes);
  } else if (signature == FileSignature::tiff) {
    header = read_tiff_header(bytes);
  } else if (signature == FileSignature::bmp) {
    header = read_bmp_header(bytes);
  } else {
    header.reason = "neither JPEG, PNG, TIFF, BMP nor HEIC";
  }
  if (header.status != PhotographStatus::ok) {
    image.status = header.status;
    image.reason = header.reason;
    return image;
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
  if (image.grey.depth() == CV_16U) image.tone = judged_tone(bytes, image.grey);
  image.status = PhotographStatus::ok;
  return image;
}

}  // namespace hexcal
