#include "camera_calib/remeasure_markers.h"

#include <oneapi/tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <array>

#include "camera_calib/detect_sheets.h"
#include "camera_calib/initial_camera.h"
#include "photogrammetry/markers/refine.h"

namespace hexcal {
namespace {

// A tenth of what the best corner's noise is: an error that all photographs share does not average out.
constexpr double kBentOtherwisePx = 3e-4;

std::array<Eigen::Vector2d, 4> corners_of(const FeatureObservation& feature) {
  return {feature.px.segment<2>(0), feature.px.segment<2>(2), feature.px.segment<2>(4),
          feature.px.segment<2>(6)};
}

// Largest distance that stays between the two lenses' ideal images of a marker after the best homography, px.
double bent_px(const FeatureObservation& feature, const CameraModel& before, const CameraModel& after) {
  constexpr int kSide = 5;
  const auto corners = corners_of(feature);
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

std::vector<std::size_t> markers_bent_otherwise(const std::vector<FeatureObservation>& features,
                                                const CameraModel& before, const CameraModel& after) {
  std::vector<std::size_t> which;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (features[i].points() == 4 && bent_px(features[i], before, after) > kBentOtherwisePx) {
      which.push_back(i);
    }
  }
  return which;
}

void remeasure_markers(const cv::Mat& grey, ToneCurve tone, const std::vector<Sheet>& sheets,
                       const CameraModel& camera, const std::vector<std::size_t>& which,
                       std::vector<FeatureObservation>& features) {
  tbb::parallel_for(std::size_t{0}, which.size(), [&](std::size_t k) {
    FeatureObservation& feature = features[which[k]];
    const Sheet& sheet = sheets[static_cast<std::size_t>(feature.sheet)];
    const auto index = static_cast<std::size_t>(feature.first_point / 4);
    const int id = sheet_geometry(sheet).markers[index].id;
    const MarkerPattern& pattern = marker_family(sheet.family).patterns[static_cast<std::size_t>(id)];
    feature = feature_of_marker(refine_marker(grey, tone, pattern, corners_of(feature), {}, &camera),
                                feature.sheet, feature.first_point);
  });
}

}  // namespace hexcal
