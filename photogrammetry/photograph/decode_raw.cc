#include <libraw/libraw.h>

#include <algorithm>
#include <array>
#include <memory>

#include "photogrammetry/photograph/decoders.h"
#include "photogrammetry/photograph/file_signature.h"
#include "photogrammetry/photograph/raster_header.h"

namespace hexcal {
namespace {

// Interpolated green is the mean of its four neighbours, sampled green is itself: two different blurs in a
// chequered pattern, which no photometric model of an edge can follow. The sampled pixels take an eighth of
// each of their four diagonal (sampled) neighbours: then both have the same second moment, 0.5 px^2 per axis.
void even_out_green(LibRaw& raw, cv::Mat& green) {
  const cv::Mat_<std::uint16_t> before = green.clone();
  for (int y = 1; y + 1 < green.rows; ++y) {
    for (int x = 1; x + 1 < green.cols; ++x) {
      const int colour = raw.COLOR(y, x);
      if (colour != 1 && colour != 3) continue;
      const int diagonal =
          before(y - 1, x - 1) + before(y - 1, x + 1) + before(y + 1, x - 1) + before(y + 1, x + 1);
      green.at<std::uint16_t>(y, x) = static_cast<std::uint16_t>((4 * before(y, x) + diagonal + 4) / 8);
    }
  }
}

constexpr unsigned kMaxRawMegabytes = 640;

// LibRaw shows pixels at the borders that the camera uses for demosaicing and leaves out of its JPEGs. The
// size of the JPEG is that of the preview in the file where it is a whole one, or is known of the body.
cv::Rect camera_crop(const LibRaw& raw, const cv::Size& shown) {
  const auto& info = raw.imgdata.idata;
  const auto& preview = raw.imgdata.thumbnail;
  return jpeg_crop(info.make, info.model, {preview.twidth, preview.theight}, shown);
}

DecodedImage develop(std::string_view bytes) {
  DecodedImage image;
  image.tone = ToneCurve::linear;
  // LibRaw's object is too large for the stack of a worker thread.
  const auto raw = std::make_unique<LibRaw>();
  auto& params = raw->imgdata.params;
  params.output_bps = 16;
  params.gamm[0] = params.gamm[1] = 1;
  params.no_auto_bright = 1;
  params.output_color = 0;
  params.user_flip = 0;
#if LIBRAW_VERSION >= LIBRAW_MAKE_VERSION(0, 21, 0)
  raw->imgdata.rawparams.max_raw_memory_mb = kMaxRawMegabytes;
#else
  params.max_raw_memory_mb = kMaxRawMegabytes;
#endif
  params.user_qual = 0;  // bilinear: linear in the samples, so edges keep their place
  std::fill(std::begin(params.user_mul), std::end(params.user_mul), 1.0F);
  const auto failed = [&image](int code) {
    if (code == LIBRAW_SUCCESS) return false;
    image.reason = LibRaw::strerror(code);
    if (code == LIBRAW_IO_ERROR || code == LIBRAW_DATA_ERROR) image.status = PhotographStatus::truncated;
    return true;
  };
  if (failed(raw->open_buffer(const_cast<char*>(bytes.data()), bytes.size()))) {
    image.status = PhotographStatus::unreadable;
    return image;
  }
  const auto& sizes = raw->imgdata.sizes;
  image.reason = size_fault(sizes.raw_width, sizes.raw_height, bytes.size());
  if (!image.reason.empty()) {
    image.status = PhotographStatus::too_large;
    return image;
  }
  constexpr unsigned kXTrans = 9;  // LibRaw's code for Fujifilm's 6 x 6 mosaic
  if (raw->imgdata.idata.filters == kXTrans || raw->imgdata.idata.filters == 0) {
    image.reason = "its sensor has no Bayer mosaic: save the photograph as 16-bit TIFF or JPEG";
    return image;
  }
  if (failed(raw->unpack()) || failed(raw->dcraw_process())) return image;
  if (raw->imgdata.image == nullptr || sizes.iheight < 1 || sizes.iwidth < 1) {
    image.reason = "no picture in it";
    return image;
  }
  image.grey.create(sizes.iheight, sizes.iwidth, CV_16UC1);
  for (int y = 0; y < image.grey.rows; ++y) {
    const ushort(*row)[4] = raw->imgdata.image + static_cast<std::ptrdiff_t>(y) * image.grey.cols;
    for (int x = 0; x < image.grey.cols; ++x) image.grey.at<std::uint16_t>(y, x) = row[x][1];
  }
  even_out_green(*raw, image.grey);
  image.grey = image.grey(camera_crop(*raw, image.grey.size())).clone();
  image.status = PhotographStatus::ok;
  return image;
}

}  // namespace

cv::Rect jpeg_crop(const std::string& make, const std::string& model, const cv::Size& preview,
                   const cv::Size& shown) {
  struct Body {
    const char* make;
    const char* model;
    cv::Size shown, jpeg;
  };
  // Where the file holds no whole preview; sizes by LibRaw 0.20 and the maker's specification.
  static const std::array kBodies{Body{"Nikon", "D3200", {6034, 4012}, {6016, 4000}}};
  constexpr int kMostMargin = 64;
  const auto fits = [&shown](const cv::Size& jpeg) {
    return jpeg.width <= shown.width && jpeg.height <= shown.height &&
           jpeg.width >= shown.width - kMostMargin && jpeg.height >= shown.height - kMostMargin;
  };
  cv::Size jpeg = shown;
  if (fits(preview)) {
    jpeg = preview;
  } else {
    for (const Body& body : kBodies) {
      if (make == body.make && model == body.model && shown == body.shown) jpeg = body.jpeg;
    }
  }
  return {(shown.width - jpeg.width) / 2, (shown.height - jpeg.height) / 2, jpeg.width, jpeg.height};
}

DecodedImage decode_raw_green(std::string_view bytes) {
  DecodedImage failed;
  const FileSignature signature = file_signature(bytes);
  if (signature != FileSignature::tiff && signature != FileSignature::raf) {
    failed.reason = "not a RAW file (NEF, DNG, CR2, ARW or RAF)";
    return failed;
  }
  try {
    return develop(bytes);
  } catch (const std::exception& error) {
    failed.reason = error.what();
  } catch (...) {  // LibRaw throws numbers
    failed.reason = "damaged";
  }
  return failed;
}

}  // namespace hexcal
