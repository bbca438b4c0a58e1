#include "camera_calib/bent_markers.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "camera_calib/detect_sheets.h"
#include "camera_calib/initial_camera.h"

namespace hexcal {
namespace {

// An error that all photographs share does not average out.
constexpr double kShareOfSigma = 0.3;

// Largest distance that stays between the two lenses' ideal images of a marker after the best homography, px.
double bent_px(const FeatureObservation& feature, const CameraModel& before, const CameraModel& after) {
  constexpr int kSide = 5;
  const auto corners = marker_corners(feature);
  std::vector<Eigen::Vector2d> from;
  std::vector<Eigen::Vector2d> to;
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j) {
      const double x = i / (kSide - 1.0);
      const double y = j / (kSide - 1.0);
      const Eigen::Vector2d px =
          (1 - y) * ((1 - x) * corners[0] + x * corners[1]) + y * ((1 - x) * corners[3] + x * corners[2]);
      const auto a = before.normalised_from_image(px);
      const auto b = after.normalised_from_image(px);
      if (!a || !b) return 0;
      from.push_back(*a * before.fy_px());
      to.push_back(*b * after.fy_px());
    }
  }
  const auto homography = homography_from_points(from, to);
  if (!homography) return 0;
  double largest = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Eigen::Vector2d mapped = (*homography * from[i].homogeneous()).hnormalized();
    largest = std::max(largest, (mapped - to[i]).norm());
  }
  return largest;
}

}  // namespace

bool bent_otherwise(const std::vector<FeatureObservation>& features, const CameraModel& before,
                    const CameraModel& after) {
  return std::any_of(features.begin(), features.end(), [&](const FeatureObservation& feature) {
    if (feature.points() != 4 || feature.status != MarkerStatus::ok) return false;
    const double sigma_px = std::sqrt(feature.covariance_px2.trace() / 8);
    return bent_px(feature, before, after) > kShareOfSigma * sigma_px;
  });
}

}  // namespace hexcal
