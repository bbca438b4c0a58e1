#include <opencv2/imgcodecs.hpp>

#include "photogrammetry/photograph/decoders.h"
#include "photogrammetry/photograph/file_signature.h"
#include "photogrammetry/photograph/raster_header.h"

namespace hexcal {

DecodedImage decode_raster(std::string_view bytes) {
  DecodedImage image;
  const FileSignature signature = file_signature(bytes);
  if (signature == FileSignature::other) {
    image.reason = "neither JPEG, PNG nor TIFF";
    return image;
  }
  const RasterHeader header =
      signature == FileSignature::png ? read_png_header(bytes) : read_tiff_header(bytes);
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
  image.status = PhotographStatus::ok;
  return image;
}

}  // namespace hexcal
