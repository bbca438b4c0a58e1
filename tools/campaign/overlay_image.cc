#include "tools/campaign/overlay_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "photogrammetry/photograph/photograph.h"
#include "photogrammetry/photograph/sha256.h"
#include "tools/io/atomic_file.h"
#include "tools/io/residual_file.h"

namespace hexcal {
namespace {

constexpr double kMagnification = 200;
constexpr int kJpegQuality = 85;

constexpr double kDimming = 0.75;     // so that the drawing stands out
constexpr int kSubpixelBits = 4;      // OpenCV draws in sixteenths of a pixel
constexpr double kScaleBarPx = 0.05;  // residual that the legend shows

cv::Point fine(const Eigen::Vector2d& px) {
  return {cvRound(px.x() * (1 << kSubpixelBits)), cvRound(px.y() * (1 << kSubpixelBits))};
}

void draw_line(cv::Mat& image, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
               const cv::Scalar& colour, int width) {
  cv::line(image, fine(from), fine(to), colour, width, cv::LINE_AA, kSubpixelBits);
}

// Dark under light, so that it reads on any ground. `height_px` is that of a capital letter.
void draw_text(cv::Mat& image, const std::string& text, const Eigen::Vector2d& centre, double height_px,
               const cv::Scalar& colour) {
  const double scale = height_px / 21;  // FONT_HERSHEY_SIMPLEX is 21 px high at scale 1
  const int width = std::max(1, cvRound(1.6 * scale));
  int base = 0;
  const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, scale, width, &base);
  const cv::Point at(cvRound(centre.x() - 0.5 * size.width), cvRound(centre.y() + 0.5 * size.height));
  cv::putText(image, text, at, cv::FONT_HERSHEY_SIMPLEX, scale, cv::Scalar(0, 0, 0), 3 * width, cv::LINE_AA);
  cv::putText(image, text, at, cv::FONT_HERSHEY_SIMPLEX, scale, colour, width, cv::LINE_AA);
}

const cv::Scalar kUsed(90, 220, 90);
const cv::Scalar kRejected(60, 60, 255);
const cv::Scalar kNotMeasured(190, 190, 190);
const cv::Scalar kResidual(0, 200, 255);

void draw_marker(const Sighting* sighting, const MarkerObservation& seen, const Vector8d& residual_px,
                 cv::Mat& image) {
  const bool used = sighting != nullptr && sighting->status == SightingStatus::used;
  const bool rejected = sighting != nullptr && sighting->status == SightingStatus::outlier;
  const cv::Scalar& colour = used ? kUsed : rejected ? kRejected : kNotMeasured;
  const int width = std::max(1, image.cols / 1500);
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  for (std::size_t c = 0; c < 4; ++c) {
    draw_line(image, seen.corners_px[c], seen.corners_px[(c + 1) % 4], colour, width);
    centre += seen.corners_px[c] / 4;
  }
  for (std::size_t c = 0; c < 4 && (used || rejected); ++c) {
    const Eigen::Vector2d end =
        seen.corners_px[c] + kMagnification * residual_px.segment<2>(2 * static_cast<Eigen::Index>(c));
    draw_line(image, seen.corners_px[c], end, kResidual, 2 * width);
    cv::circle(image, fine(end), fine({1.5 * width, 0}).x, kResidual, cv::FILLED, cv::LINE_AA, kSubpixelBits);
  }
  const double height = std::clamp(0.22 * seen.side_px, image.cols / 120.0, image.cols / 30.0);
  draw_text(image, std::to_string(seen.id), centre, height, colour);
  if (!used) {
    draw_text(image, sighting_words(sighting, seen), centre + Eigen::Vector2d(0, 1.3 * height), 0.55 * height,
              colour);
  }
}

// What the drawing means, at the foot of it.
void draw_legend(const std::string& text, cv::Mat& image) {
  const double height = image.cols / 75.0;
  const Eigen::Vector2d foot(0, image.rows - 1.5 * height);
  const double length = kMagnification * kScaleBarPx;
  const Eigen::Vector2d start = foot + Eigen::Vector2d(2 * height, 0);
  draw_line(image, start, start + Eigen::Vector2d(length, 0), kResidual, std::max(2, image.cols / 750));
  const std::string all = fmt::format("{} px, x{:.0f}    {}", kScaleBarPx, kMagnification, text);
  int base = 0;
  const cv::Size size = cv::getTextSize(all, cv::FONT_HERSHEY_SIMPLEX, height / 21, 1, &base);
  draw_text(image, all, start + Eigen::Vector2d(length + height + 0.5 * size.width, 0), height, kNotMeasured);
}

// Folders and file in one name; with a hash of it where another photograph's would be the same, or the system
// takes no name so long.
std::string overlay_name(const ImageListing& listing, std::size_t photograph) {
  constexpr std::size_t kLongest = 240;
  constexpr std::size_t kKept = 200;
  const auto flat = [&listing](std::size_t i) {
    std::string name = listing.images[i].name;
    std::replace(name.begin(), name.end(), '/', '_');
    const bool is_jpeg = name.ends_with(".jpg") || name.ends_with(".JPG");
    return is_jpeg ? name : name + ".jpg";
  };
  const std::string name = flat(photograph);
  bool alone = name.size() <= kLongest;
  for (std::size_t i = 0; i < listing.images.size() && alone; ++i) alone = i == photograph || flat(i) != name;
  if (alone) return name;
  return fmt::format("{}.{}.jpg", name.substr(0, std::min(kKept, name.size() - 4)),
                     sha256_hex(listing.images[photograph].name).substr(0, 12));
}

}  // namespace

std::optional<std::filesystem::path> write_overlay(const OpenCampaign& open,
                                                   const CampaignObservations& observations,
                                                   const CampaignResult& result, std::size_t photograph) {
  const CampaignImage& entry = open.listing.images[photograph];
  const Photograph read = read_photograph(entry.path);
  if (read.status != PhotographStatus::ok) return std::nullopt;
  cv::Mat grey = read.grey;
  if (grey.depth() == CV_16U) grey.convertTo(grey, CV_8U, 1.0 / 257);
  cv::Mat image;
  cv::cvtColor(kDimming * grey, image, cv::COLOR_GRAY2BGR);
  const auto places = sightings_by_id(result);
  for (const MarkerObservation& seen : observations.photographs[photograph].seen.markers) {
    const Sighting* found = nullptr;
    Vector8d residual = Vector8d::Zero();
    const auto place = places.find({static_cast<int>(photograph), seen.id});
    if (place != places.end()) {
      found = &result.adjusted.sightings[place->second];
      if (place->second < result.adjusted.residuals_px.size())
        residual = result.adjusted.residuals_px[place->second];
    }
    draw_marker(found, seen, residual, image);
  }
  const MeasuredPhotograph& measured = result.photographs[photograph];
  draw_legend(
      is_used(measured.status)
          ? fmt::format("{}: {} markers, {} rejected, rms {:.4f} px", entry.name, measured.residuals.markers,
                        measured.residuals.rejected, measured.residuals.rms_px)
          : fmt::format("{}: {}: {}", entry.name, photo_status_name(measured.status), measured.words),
      image);
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
  const std::filesystem::path path = open.results / "overlays" / overlay_name(open.listing, photograph);
  write_file_atomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  return path;
}

}  // namespace hexcal
