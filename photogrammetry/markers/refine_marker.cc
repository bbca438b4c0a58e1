#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "kinematics/geometry/input_error.h"
#include "photogrammetry/markers/edge_scan.h"
#include "photogrammetry/markers/marker_verdict.h"
#include "photogrammetry/markers/refine.h"

namespace hexcal {
namespace {

constexpr double kNoiseMarginPx = 24;
constexpr double kLensSigma = 0.01;       // of a real lens about the stand-in all markers agree on
constexpr int kPixelsOfFirstLook = 2000;  // when the photograph's own parameters are still to be told

cv::Rect box_around(const std::array<Eigen::Vector2d, 4>& corners, double margin) {
  Eigen::Vector2d low = corners[0];
  Eigen::Vector2d high = corners[0];
  for (const auto& corner : corners) {
    low = low.cwiseMin(corner);
    high = high.cwiseMax(corner);
  }
  return {static_cast<int>(std::floor(low.x() - margin)), static_cast<int>(std::floor(low.y() - margin)),
          static_cast<int>(std::ceil(high.x() - low.x() + 2 * margin)),
          static_cast<int>(std::ceil(high.y() - low.y() + 2 * margin))};
}

double min_side(const std::array<Eigen::Vector2d, 4>& corners) {
  double least = (corners[0] - corners[3]).norm();
  for (std::size_t i = 0; i < 3; ++i) least = std::min(least, (corners[i + 1] - corners[i]).norm());
  return least;
}

double mean_side(const std::array<Eigen::Vector2d, 4>& corners) {
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) sum += (corners[(i + 1) % 4] - corners[i]).norm();
  return sum / 4;
}

bool inside_frame(const std::array<Eigen::Vector2d, 4>& corners, const cv::Mat& grey) {
  constexpr double kMargin = 0.5;
  return std::all_of(corners.begin(), corners.end(), [&grey](const Eigen::Vector2d& corner) {
    return corner.x() > kMargin && corner.y() > kMargin && corner.x() < grey.cols - 1 - kMargin &&
           corner.y() < grey.rows - 1 - kMargin;
  });
}

MarkerStatus verdict(const PhotometricFit& fit, const MarkerObservation& marker, const cv::Mat& grey,
                     double tilt, const RefineOptions& options) {
  if (!fit.converged) return MarkerStatus::not_refined;
  if (!inside_frame(fit.corners_px, grey)) return MarkerStatus::cut_by_frame;
  if (min_side(fit.corners_px) < options.min_side_px * std::cos(tilt)) return MarkerStatus::too_small;
  if (marker.side_px < options.min_side_px) return MarkerStatus::too_small;
  if (tilt * 180 / std::numbers::pi > options.max_tilt_deg) return MarkerStatus::too_steep;
  if (fit.saturated > options.max_saturated) return MarkerStatus::saturated;
  if (marker.contrast < options.min_contrast) return MarkerStatus::low_contrast;
  if (fit.visible < options.min_visible) return MarkerStatus::occluded;
  if (marker.chi2_per_dof > options.max_chi2_per_dof) return MarkerStatus::misfit;
  return MarkerStatus::ok;
}

}  // namespace

void RefineOptions::validate() const {
  const auto check = [](const char* field, double value, double low, double high) {
    if (!(value >= low && value <= high)) {
      throw InputError(fmt::format("{} is {}, wanted {} to {}", field, value, low, high));
    }
  };
  check("min_side_px", min_side_px, 4, 1e5);
  check("max_tilt_deg", max_tilt_deg, 0, 89);
  check("min_contrast", min_contrast, 0, 1);
  check("max_saturated", max_saturated, 0, 1);
  check("min_visible", min_visible, 0, 1);
  check("max_chi2_per_dof", max_chi2_per_dof, 1, 1e9);
}

double tilt_of_square(const std::array<Eigen::Vector2d, 4>& corners_px, const CameraModel* camera) {
  // Local affine map of the square at its centre. Seen by a camera, it is taken to the plane across the line
  // of sight first, so that a marker at the frame's edge is judged by its own angle.
  std::array<Eigen::Vector2d, 4> points = corners_px;
  Eigen::Matrix2d across = Eigen::Matrix2d::Identity();
  if (camera != nullptr) {
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (auto& point : points) {
      const auto normalised = camera->normalised_from_image(point);
      if (!normalised) return 0;
      point = *normalised;
      middle += 0.25 * point;
    }
    const double length2 = 1 + middle.squaredNorm();
    const double r = middle.norm();
    if (r > 1e-9) {
      const Eigen::Vector2d radial = middle / r;
      const Eigen::Vector2d tangent(-radial.y(), radial.x());
      across = radial * radial.transpose() / length2 + tangent * tangent.transpose() / std::sqrt(length2);
    }
  }
  Eigen::Matrix2d affine;
  affine.col(0) = 0.25 * (points[1] + points[2] - points[0] - points[3]);
  affine.col(1) = 0.25 * (points[2] + points[3] - points[0] - points[1]);
  const Eigen::JacobiSVD<Eigen::Matrix2d> svd(across * affine);
  const auto singular = svd.singularValues();
  return singular[0] > 0 ? std::acos(std::clamp(singular[1] / singular[0], 0.0, 1.0)) : 0;
}

PhotometricFit fit_marker(const cv::Mat& grey, const PhotographModel& photograph,
                          const MarkerPattern& pattern, const std::array<Eigen::Vector2d, 4>& corners_px,
                          bool free_tone, bool free_lens) {
  FitRequest request{BlurredPattern(pattern), pattern.square_cells, corners_px};
  request.free_tone = free_tone;
  request.free_lens = free_lens;
  if (free_tone || free_lens) request.max_pixels = kPixelsOfFirstLook;
  if (const auto scanned =
          scan_edges(grey, photograph.tone, request.pattern, pattern.square_cells, corners_px)) {
    request.corners_px = *scanned;
  }
  return fit_pattern(grey, photograph, request);
}

PhotometricFit fit_marker_again(const cv::Mat& grey, const PhotographModel& photograph,
                                const MarkerPattern& pattern, const PhotometricFit& before, bool free_lens) {
  FitRequest request{BlurredPattern(pattern), pattern.square_cells, before.corners_px};
  request.free_lens = free_lens;
  request.lens_sigma = kLensSigma;
  request.start = FitStart{before.blur_px, before.black, before.white};
  return fit_pattern(grey, photograph, request);
}

MarkerObservation observation_from(const PhotometricFit& fit, const cv::Mat& grey, const CameraModel* camera,
                                   const ResidualLevel& level, const RefineOptions& options) {
  MarkerObservation marker;
  if (!fit.converged) return marker;
  marker.corners_px = fit.corners_px;
  marker.chi2_per_dof = fit.chi2_per_dof / level.noise;
  marker.covariance_px2 = fit.covariance_px2 * (fit.chi2_per_dof * level.correlation);
  marker.blur_px = fit.blur_px;
  marker.contrast = fit.white - fit.black;
  marker.side_px = mean_side(fit.corners_px);
  marker.status = verdict(fit, marker, grey, tilt_of_square(fit.corners_px, camera), options);
  return marker;
}

MarkerObservation refine_marker(const cv::Mat& grey, ToneCurve tone, const MarkerPattern& pattern,
                                const std::array<Eigen::Vector2d, 4>& corners_px,
                                const RefineOptions& options, const CameraModel* camera) {
  options.validate();
  const PhotographModel photograph{camera != nullptr ? PixelMap(*camera) : PixelMap(grey.cols, grey.rows, {}),
                                   ToneResponse(tone),
                                   estimate_noise(grey, box_around(corners_px, kNoiseMarginPx))};
  const bool free_tone = tone == ToneCurve::srgb && mean_side(corners_px) > 3 * options.min_side_px;
  const PhotometricFit fit = fit_marker(grey, photograph, pattern, corners_px, free_tone, false);
  return observation_from(fit, grey, camera, {1.0, std::max(1.0, fit.covariance_factor / fit.chi2_per_dof)},
                          options);
}

}  // namespace hexcal
