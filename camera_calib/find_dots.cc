#include "camera_calib/find_dots.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "camera_calib/initial_camera.h"

namespace hexcal {
namespace {

struct Blob {
  Eigen::Vector2d centre_px;
  Eigen::Matrix2d axes_px;  // columns: half axes of the ellipse
};

cv::Mat dark_mask(const cv::Mat& grey) {
  cv::Mat eight = grey;
  if (grey.depth() != CV_8U) cv::normalize(grey, eight, 0, 255, cv::NORM_MINMAX, CV_8U);
  cv::Mat dark;
  const int block = (std::max(eight.cols, eight.rows) / 24) | 1;
  cv::adaptiveThreshold(eight, dark, 255, cv::ADAPTIVE_THRESH_MEAN_C, cv::THRESH_BINARY_INV, block, 25);
  return dark;
}

// Dark spots that fill their ellipse.
std::vector<Blob> elliptic_blobs(const cv::Mat& dark) {
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(dark, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  const double largest = 0.002 * dark.cols * dark.rows;
  std::vector<Blob> blobs;
  for (const auto& contour : contours) {
    const double area = cv::contourArea(contour);
    if (contour.size() < 10 || area < 25 || area > largest) continue;
    const cv::RotatedRect e = cv::fitEllipse(contour);
    const double fitted = 0.25 * std::numbers::pi * e.size.width * e.size.height;
    if (std::abs(fitted - area) > 0.15 * fitted || e.size.height > 5 * e.size.width) continue;
    const double angle = e.angle * std::numbers::pi / 180;
    Blob blob;
    blob.centre_px = {e.center.x, e.center.y};
    blob.axes_px.col(0) = 0.5 * e.size.width * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    blob.axes_px.col(1) = 0.5 * e.size.height * Eigen::Vector2d(-std::sin(angle), std::cos(angle));
    blobs.push_back(blob);
  }
  return blobs;
}

// Number of dark arcs around a dot, where its ring would be; 0 if there is none.
int arcs_around(const cv::Mat& dark, const Blob& blob) {
  constexpr int kSamples = 180;
  const double radius = kRingInner + kRingOuter;  // in dot radii: the middle of the ring
  std::array<bool, kSamples> is_dark{};
  int count = 0;
  for (int i = 0; i < kSamples; ++i) {
    const double angle = 2 * std::numbers::pi * i / kSamples;
    const Eigen::Vector2d at =
        blob.centre_px + radius * blob.axes_px * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    const cv::Point px(cvRound(at.x()), cvRound(at.y()));
    if (px.x < 0 || px.y < 0 || px.x >= dark.cols || px.y >= dark.rows) return 0;
    is_dark[static_cast<std::size_t>(i)] = dark.at<std::uint8_t>(px) != 0;
    count += is_dark[static_cast<std::size_t>(i)] ? 1 : 0;
  }
  if (count < kSamples / 5 || count > 4 * kSamples / 5) return 0;
  int arcs = 0;
  int run = 0;
  // Runs shorter than 10 degrees are noise; begin behind a gap.
  const auto gap = std::find(is_dark.begin(), is_dark.end(), false) - is_dark.begin();
  for (int i = 1; i <= kSamples; ++i) {
    if (is_dark[static_cast<std::size_t>((gap + i) % kSamples)]) {
      ++run;
    } else {
      arcs += run >= 5 ? 1 : 0;
      run = 0;
    }
  }
  return arcs <= 4 ? arcs : 0;
}

// Nearest blob to every dot that a homography predicts, within a third of the way to the next dot.
std::vector<std::optional<Eigen::Vector2d>> match(const Eigen::Matrix3d& image_from_sheet,
                                                  const std::vector<SheetDot>& dots, double pitch_mm,
                                                  const std::vector<Blob>& blobs) {
  std::vector<std::optional<Eigen::Vector2d>> out;
  for (const SheetDot& dot : dots) {
    const Eigen::Vector2d at = (image_from_sheet * dot.centre_mm.homogeneous()).hnormalized();
    double reach = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector2d& step : {Eigen::Vector2d(pitch_mm, 0), Eigen::Vector2d(0, pitch_mm)}) {
      const Eigen::Vector2d next = (image_from_sheet * (dot.centre_mm + step).homogeneous()).hnormalized();
      reach = std::min(reach, (next - at).norm() / 3);
    }
    std::optional<Eigen::Vector2d> best;
    for (const Blob& blob : blobs) {
      const double distance = (blob.centre_px - at).norm();
      if (distance < reach) {
        reach = distance;
        best = blob.centre_px;
      }
    }
    out.push_back(best);
  }
  return out;
}

// From four corresponding points to all dots that lie where the sheet puts them.
std::vector<std::optional<Eigen::Vector2d>> grow_grid(std::vector<Eigen::Vector2d> sheet_mm,
                                                      std::vector<Eigen::Vector2d> image_px,
                                                      const std::vector<SheetDot>& dots, double pitch_mm,
                                                      const std::vector<Blob>& blobs) {
  std::vector<std::optional<Eigen::Vector2d>> found;
  for (int round = 0; round < 2; ++round) {
    const auto homography = homography_from_points(sheet_mm, image_px);
    if (!homography) return {};
    found = match(*homography, dots, pitch_mm, blobs);
    sheet_mm.clear();
    image_px.clear();
    for (std::size_t i = 0; i < dots.size(); ++i) {
      if (!found[i]) continue;
      sheet_mm.push_back(dots[i].centre_mm);
      image_px.push_back(*found[i]);
    }
  }
  return found;
}

}  // namespace

std::vector<std::optional<Eigen::Vector2d>> find_ringed_dots(const cv::Mat& grey, const Sheet& sheet) {
  const cv::Mat dark = dark_mask(grey);
  const std::vector<Blob> blobs = elliptic_blobs(dark);
  const std::vector<SheetDot> dots = sheet_geometry(sheet).dots;
  std::array<std::vector<Eigen::Vector2d>, 5> ringed;
  for (const Blob& blob : blobs)
    ringed[static_cast<std::size_t>(arcs_around(dark, blob))].push_back(blob.centre_px);
  std::array<Eigen::Vector2d, 5> ring_mm;
  for (const SheetDot& dot : dots) ring_mm[static_cast<std::size_t>(dot.ring_arcs)] = dot.centre_mm;
  // Print and floor may look like a ring: of all fours of candidates the one that explains the most dots.
  std::vector<std::optional<Eigen::Vector2d>> best;
  std::ptrdiff_t most = 0;
  // A ring seen too flat to be read is any dot, if it is the only one.
  constexpr std::ptrdiff_t kCandidates = 4;
  constexpr std::size_t kMostBlobs = 400;
  int unread = 0;
  for (std::size_t arcs = 1; arcs < ringed.size(); ++arcs) {
    auto& list = ringed[arcs];
    if (std::ssize(list) > kCandidates) list.erase(list.begin() + kCandidates, list.end());
    if (!list.empty() || ++unread > 1 || blobs.size() > kMostBlobs) continue;
    for (const Blob& blob : blobs) list.push_back(blob.centre_px);
  }
  for (const Eigen::Vector2d& one : ringed[1]) {
    for (const Eigen::Vector2d& two : ringed[2]) {
      for (const Eigen::Vector2d& three : ringed[3]) {
        for (const Eigen::Vector2d& four : ringed[4]) {
          auto found = grow_grid({ring_mm[1], ring_mm[2], ring_mm[3], ring_mm[4]}, {one, two, three, four},
                                 dots, sheet.pitch_mm, blobs);
          const auto seen =
              std::count_if(found.begin(), found.end(), [](const auto& px) { return px.has_value(); });
          if (seen <= most) continue;
          most = seen;
          best = std::move(found);
        }
      }
    }
  }
  return 2 * most >= static_cast<std::ptrdiff_t>(dots.size()) ? best
                                                              : std::vector<std::optional<Eigen::Vector2d>>{};
}

}  // namespace hexcal
