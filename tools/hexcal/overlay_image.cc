#include "tools/hexcal/overlay_image.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "photogrammetry/photograph/photograph.h"
#include "tools/io/atomic_file.h"

namespace hexcal {
namespace {

constexpr double kMagnification = 200;
constexpr int kJpegQuality = 85;

cv::Point pixel(const Eigen::Vector2d& px) { return {cvRound(px.x()), cvRound(px.y())}; }

void draw_marker(const Sighting* sighting, const MarkerObservation& seen, const Vector8d& residual_px,
                 cv::Mat& image) {
  const bool used = sighting != nullptr && sighting->status == SightingStatus::used;
  const bool rejected = sighting != nullptr && sighting->status == SightingStatus::outlier;
  const cv::Scalar colour = used       ? cv::Scalar(60, 200, 60)
                            : rejected ? cv::Scalar(50, 50, 230)
                                       : cv::Scalar(160, 160, 160);
  const int width = std::max(1, image.cols / 2000);
  for (std::size_t c = 0; c < 4; ++c) {
    cv::line(image, pixel(seen.corners_px[c]), pixel(seen.corners_px[(c + 1) % 4]), colour, width,
             cv::LINE_AA);
    if (used || rejected) {
      const Eigen::Vector2d end =
          seen.corners_px[c] + kMagnification * residual_px.segment<2>(2 * static_cast<Eigen::Index>(c));
      cv::arrowedLine(image, pixel(seen.corners_px[c]), pixel(end), cv::Scalar(0, 200, 255), width,
                      cv::LINE_AA);
    }
  }
  cv::putText(image, std::to_string(seen.id), pixel(seen.corners_px[0]), cv::FONT_HERSHEY_SIMPLEX,
              image.cols / 3000.0, colour, 2 * width, cv::LINE_AA);
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
  cv::cvtColor(grey, image, cv::COLOR_GRAY2BGR);
  for (const MarkerObservation& seen : observations.photographs[photograph].seen.markers) {
    const Sighting* found = nullptr;
    Vector8d residual = Vector8d::Zero();
    for (std::size_t s = 0; s < result.adjusted.sightings.size(); ++s) {
      const Sighting& sighting = result.adjusted.sightings[s];
      if (sighting.photo != static_cast<int>(photograph) || sighting.marker < 0) continue;
      if (result.network.markers[static_cast<std::size_t>(sighting.marker)].id != seen.id) continue;
      found = &sighting;
      if (s < result.adjusted.residuals_px.size()) residual = result.adjusted.residuals_px[s];
    }
    draw_marker(found, seen, residual, image);
  }
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
  std::string name = entry.name;
  std::replace(name.begin(), name.end(), '/', '_');
  const std::filesystem::path path = open.results / "overlays" / (name + ".jpg");
  write_file_atomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  return path;
}

}  // namespace hexcal
