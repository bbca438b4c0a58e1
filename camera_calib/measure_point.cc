#include "camera_calib/measure_point.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace hexcal {
namespace {

constexpr double kSaddleSigmaPx = 0.05;
constexpr double kDotSigmaPx = 0.05;
constexpr double kMaxMovePx = 4;

cv::Mat eight_bit_window(const cv::Mat& grey, const cv::Rect& window) {
  cv::Mat out;
  const double scale = grey.depth() == CV_16U ? 1.0 / 256 : 1.0;
  grey(window).convertTo(out, CV_8U, scale);
  return out;
}

// Centroid of the image of a disc: its circle's points, mapped, as a polygon.
Eigen::Vector2d disc_centroid(const Eigen::Matrix3d& image_from_plane, const Eigen::Vector2d& centre,
                              double radius) {
  constexpr int kCorners = 72;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double area = 0;
  const auto corner = [&](int i) {
    const double angle = 2 * std::numbers::pi * i / kCorners;
    const Eigen::Vector2d at = centre + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    return Eigen::Vector2d((image_from_plane * at.homogeneous()).hnormalized());
  };
  const Eigen::Vector2d origin = corner(0);
  for (int i = 1; i + 1 < kCorners; ++i) {
    const Eigen::Vector2d a = corner(i) - origin;
    const Eigen::Vector2d b = corner(i + 1) - origin;
    const double twice = a.x() * b.y() - a.y() * b.x();
    area += twice;
    sum += twice * (a + b) / 3;
  }
  return origin + sum / area;
}

// By the gradients around it (Forstner & Gulch 1987), in a window of 45 % of the way to the neighbours or as
// far as a marker's border, at most 12 px.
PointObservation saddle_by_gradients(const cv::Mat& grey, const SaddleGuess& guess) {
  const Eigen::Vector2d& approximate_px = guess.px;
  PointObservation point;
  point.px = approximate_px;
  const double half = std::min(12.0, (guess.gap > 0 ? std::min(0.45, guess.gap) : 0.45) *
                                         std::min(guess.to_x_px.norm(), guess.to_y_px.norm()));
  if (half < 2) {
    point.status = MarkerStatus::too_small;
    return point;
  }
  const int reach = static_cast<int>(half) + 8;
  const cv::Rect window(cvRound(approximate_px.x()) - reach, cvRound(approximate_px.y()) - reach,
                        2 * reach + 1, 2 * reach + 1);
  if ((window & cv::Rect(0, 0, grey.cols, grey.rows)) != window) {
    point.status = MarkerStatus::cut_by_frame;
    return point;
  }
  const cv::Mat pixels = eight_bit_window(grey, window);
  std::vector<cv::Point2f> corner{
      {static_cast<float>(approximate_px.x() - window.x), static_cast<float>(approximate_px.y() - window.y)}};
  const int side = std::max(2, static_cast<int>(half));
  cv::cornerSubPix(pixels, corner, {side, side}, {-1, -1},
                   cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 50, 1e-4));
  point.px = {static_cast<double>(corner[0].x) + window.x, static_cast<double>(corner[0].y) + window.y};
  point.covariance_px2 = kSaddleSigmaPx * kSaddleSigmaPx * Eigen::Matrix2d::Identity();
  point.status = (point.px - approximate_px).norm() < std::min(kMaxMovePx, half) ? MarkerStatus::ok
                                                                                 : MarkerStatus::not_refined;
  return point;
}

// Whether a coarser method may still measure what the photometric fit refused: clipped or processed pixels
// harm it least.
bool only_not_photometric(MarkerStatus status) {
  return status == MarkerStatus::saturated || status == MarkerStatus::misfit ||
         status == MarkerStatus::not_refined;
}

struct DotByArea {
  PointObservation point;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  // in the plane
  double radius = 0;                                 // there
};

// By the centroid of its darkness.
DotByArea dot_by_area(const cv::Mat& grey, const Eigen::Matrix3d& image_from_plane,
                      const Eigen::Vector2d& centre_in_plane, double radius) {
  DotByArea dot;
  PointObservation& point = dot.point;
  const Eigen::Vector2d centre = (image_from_plane * centre_in_plane.homogeneous()).hnormalized();
  point.px = centre;
  double reach = 0;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector2d edge = centre_in_plane + 1.8 * radius *
                                                       Eigen::Vector2d(std::cos(std::numbers::pi * i / 4),
                                                                       std::sin(std::numbers::pi * i / 4));
    reach = std::max(reach, ((image_from_plane * edge.homogeneous()).hnormalized() - centre).norm());
  }
  const int half = static_cast<int>(std::ceil(reach));
  const cv::Rect window(cvRound(centre.x()) - half, cvRound(centre.y()) - half, 2 * half + 1, 2 * half + 1);
  if (half < 4 || half > 2000) {
    point.status = MarkerStatus::too_small;
    return dot;
  }
  if ((window & cv::Rect(0, 0, grey.cols, grey.rows)) != window) {
    point.status = MarkerStatus::cut_by_frame;
    return dot;
  }
  const cv::Mat pixels = eight_bit_window(grey, window);
  const Eigen::Matrix3d plane_from_image = image_from_plane.inverse();
  // Paper around the dot, ink in its middle; pixels beyond the paper's and ink's noise count in full or not
  // at all.
  double paper = 0;
  double paper_count = 0;
  double ink = 255;
  std::vector<std::pair<Eigen::Vector2d, double>> inside;
  for (int y = 0; y < pixels.rows; ++y) {
    for (int x = 0; x < pixels.cols; ++x) {
      const Eigen::Vector2d px(x + window.x, y + window.y);
      const double r =
          ((plane_from_image * px.homogeneous()).hnormalized() - centre_in_plane).norm() / radius;
      const double value = pixels.at<std::uint8_t>(y, x);
      if (r > 1.4 && r < 1.8) {
        paper += value;
        paper_count += 1;
      }
      if (r < 1.4) inside.emplace_back(px, value);
      if (r < 0.5) ink = std::min(ink, value);
    }
  }
  paper /= std::max(paper_count, 1.0);
  point.contrast = (paper - ink) / 255;
  if (point.contrast < 0.08) {
    point.status = MarkerStatus::low_contrast;
    return dot;
  }
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double weights = 0;
  for (const auto& [px, value] : inside) {
    const double weight = std::clamp((paper - value) / (paper - ink) * 1.2 - 0.1, 0.0, 1.0);
    sum += weight * px;
    weights += weight;
  }
  // The area of what is dark tells the true radius, and with it the eccentricity.
  const Eigen::Matrix3d& g = plane_from_image;
  const Eigen::Vector3d h = g * (sum / weights).homogeneous();
  const Eigen::Matrix2d by_px = (g.topLeftCorner<2, 2>() - h.hnormalized() * g.block<1, 2>(2, 0)) / h.z();
  dot.radius = std::sqrt(weights * std::abs(by_px.determinant()) / std::numbers::pi);
  const Eigen::Vector2d eccentricity = disc_centroid(image_from_plane, centre_in_plane, dot.radius) - centre;
  point.px = sum / weights - eccentricity;
  point.covariance_px2 = kDotSigmaPx * kDotSigmaPx * Eigen::Matrix2d::Identity();
  point.status = (point.px - centre).norm() < kMaxMovePx ? MarkerStatus::ok : MarkerStatus::not_refined;
  dot.centre = (plane_from_image * point.px.homogeneous()).hnormalized();
  return dot;
}

}  // namespace

PointObservation measure_saddle(const cv::Mat& grey, ToneCurve tone, const SaddleGuess& guess) {
  const PointObservation point = refine_saddle(grey, tone, guess);
  if (point.status != MarkerStatus::not_refined) return point;
  return saddle_by_gradients(grey, guess);
}

PointObservation measure_dot(const cv::Mat& grey, ToneCurve tone, const Eigen::Matrix3d& image_from_plane,
                             const Eigen::Vector2d& centre_in_plane, double radius) {
  const DotByArea rough = dot_by_area(grey, image_from_plane, centre_in_plane, radius);
  if (rough.point.status != MarkerStatus::ok) return rough.point;
  PointObservation point = refine_dot(grey, tone, image_from_plane, rough.centre, rough.radius);
  // Sharpened edges misfit alike on all sides: the fit still stands in their middle, its covariance widened.
  if (point.status == MarkerStatus::misfit) point.status = MarkerStatus::ok;
  return only_not_photometric(point.status) ? rough.point : point;
}

}  // namespace hexcal
