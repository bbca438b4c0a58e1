#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "kinematics/geometry/input_error.h"
#include "photogrammetry/photograph/file_signature.h"
#include "photogrammetry/photograph/photograph_file.h"
#include "tools/hexcal/network_part.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

constexpr double kAllBytes = 3e6;       // of all thumbnails together, about
constexpr double kBytesPerPixel = 0.1;  // a grey JPEG of the quality below
constexpr int kThumbnailQuality = 60;
constexpr int kWidest = 360;
constexpr int kNarrowest = 120;

// Wide enough to see what is shown, narrow enough that many fit.
int thumbnail_width(std::size_t count) {
  const double pixels = kAllBytes / kBytesPerPixel / static_cast<double>(std::max<std::size_t>(count, 1));
  return std::clamp(static_cast<int>(std::sqrt(1.5 * pixels)), kNarrowest, kWidest);
}

// A JPEG's decoder can leave out resolution, which saves nearly all of the time.
int decoding_flags(int width_px, int wanted_px) {
  int flags = cv::IMREAD_GRAYSCALE;
  for (const auto& [factor, reduced] :
       {std::pair(2, cv::IMREAD_REDUCED_GRAYSCALE_2), std::pair(4, cv::IMREAD_REDUCED_GRAYSCALE_4),
        std::pair(8, cv::IMREAD_REDUCED_GRAYSCALE_8)}) {
    if (width_px / factor >= wanted_px) flags = reduced;
  }
  return flags | cv::IMREAD_IGNORE_ORIENTATION;
}

cv::Mat decoded(const PhotographFile& file, int width_px, int wanted_px) {
  // By its content; a file's name may promise anything.
  if (file_signature(file.bytes) == FileSignature::jpeg)
    return cv::imdecode(std::vector<char>(file.bytes.begin(), file.bytes.end()),
                        decoding_flags(width_px, wanted_px));
  const Photograph photograph = decode_photograph(file);
  if (photograph.status != PhotographStatus::ok) return {};
  cv::Mat grey = photograph.grey;
  if (grey.depth() != CV_16U) return grey;
  // RAW is linear light: shown as an eye would see it.
  grey.convertTo(grey, CV_32F, 1.0 / 65535);
  if (photograph.tone == ToneCurve::linear) cv::pow(grey, 1 / 2.2, grey);
  grey.convertTo(grey, CV_8U, 255);
  return grey;
}

void add_thumbnail(const fs::path& path, int width, PhotographPart& photograph) {
  std::error_code error;
  if (photograph.status.starts_with("unreadable") || !fs::is_regular_file(path, error)) return;
  const PhotographFile file = read_photograph_file(path);
  // A page that lacks what could be read a moment ago would be another page, without a word.
  if (file.status == PhotographStatus::unreadable)
    throw InputError(fmt::format("{}: {}", path.string(), file.reason));
  const PhotographInfo info = photograph_info(file);
  cv::Mat grey = decoded(file, info.width_px, width);
  if (grey.empty()) return;
  if (info.width_px > 0) photograph.size_px = {info.width_px, info.height_px};
  const double scale = std::min(1.0, static_cast<double>(width) / grey.cols);
  const auto scaled = [scale](int side) { return std::max(1, static_cast<int>(std::lround(scale * side))); };
  cv::resize(grey, grey, {scaled(grey.cols), scaled(grey.rows)}, 0, 0, cv::INTER_AREA);
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", grey, bytes, {cv::IMWRITE_JPEG_QUALITY, kThumbnailQuality});
  photograph.thumbnail_jpeg.assign(bytes.begin(), bytes.end());
}

}  // namespace

void add_thumbnails(const fs::path& images, NetworkPart& network) {
  const int width = thumbnail_width(network.photographs.size());
  tbb::parallel_for(std::size_t{0}, network.photographs.size(), [&](std::size_t p) {
    add_thumbnail(images / network.photographs[p].name, width, network.photographs[p]);
  });
}

}  // namespace hexcal
