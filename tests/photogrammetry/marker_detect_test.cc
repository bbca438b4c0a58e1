#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "kinematics/geometry/pose.h"
#include "photogrammetry/markers/detect.h"
#include "tests/support/marker_renderer.h"

namespace hexcal {
namespace {

using testing::flat_marker;
using testing::render_image;
using testing::square_corners;
using testing::TestImage;
using testing::tilted_square;

struct Scene {
  cv::Mat grey;
  std::array<Eigen::Vector2d, 4> corners;
};

Scene one_marker(const MarkerPattern& pattern, double side_px, double turn, double tilt,
                 const Eigen::Vector2d& shift = Eigen::Vector2d::Zero()) {
  TestImage image;
  const double grid_px = side_px * pattern.cells / pattern.square_cells;
  image.width_px = image.height_px = static_cast<int>(1.5 * grid_px + 40);
  image.noise = 1.5;
  image.oversampling = 4;
  const Eigen::Vector2d centre(0.5 * image.width_px + 0.2 + shift.x(),
                               0.5 * image.height_px - 0.3 + shift.y());
  const Eigen::Matrix3d square = tilted_square(centre, side_px, turn, tilt, 0.4);
  return {render_image(image, {flat_marker(pattern, square)}), square_corners(square)};
}

double largest_error(const MarkerObservation& marker, const std::array<Eigen::Vector2d, 4>& truth) {
  double largest = 0;
  for (std::size_t i = 0; i < 4; ++i) largest = std::max(largest, (marker.corners_px[i] - truth[i]).norm());
  return largest;
}

class EveryFamily : public ::testing::TestWithParam<std::string> {};

// Corner order and square are those of the marker drawn upright, here a quarter turn away.
TEST_P(EveryFamily, IdAndCornersOfTheUprightMarker) {
  const MarkerFamily& family = marker_family(GetParam());
  const Scene scene = one_marker(family.patterns[4], 80, std::numbers::pi / 2 + 0.1, 0.3);
  const auto markers = detect_markers(scene.grey, ToneCurve::srgb, family);
  ASSERT_EQ(markers.size(), 1U);
  EXPECT_EQ(markers[0].id, 4);
  EXPECT_EQ(markers[0].status, MarkerStatus::ok) << marker_status_name(markers[0].status);
  EXPECT_LT(largest_error(markers[0], scene.corners), 0.1);
}

INSTANTIATE_TEST_SUITE_P(Families, EveryFamily, ::testing::ValuesIn(marker_family_names()),
                         [](const auto& family) { return family.param; });

const MarkerFamily& usual() { return marker_family("tag36h11"); }

MarkerStatus status_of(const cv::Mat& grey) {
  const auto markers = detect_markers(grey, ToneCurve::srgb, usual());
  return markers.size() == 1 ? markers[0].status : MarkerStatus::not_refined;
}

TEST(DetectMarkers, MirroredIsNamed) {
  Scene scene = one_marker(usual().patterns[5], 90, 0.2, 0);
  cv::flip(scene.grey, scene.grey, 1);
  EXPECT_EQ(status_of(scene.grey), MarkerStatus::mirrored);
}

TEST(DetectMarkers, InvertedIsNamed) {
  Scene scene = one_marker(usual().patterns[5], 90, 0.2, 0);
  scene.grey = 255 - scene.grey;
  EXPECT_EQ(status_of(scene.grey), MarkerStatus::inverted);
}

TEST(DetectMarkers, CutByTheFrameIsNeverTrusted) {
  const Scene scene = one_marker(usual().patterns[5], 90, 0.0, 0);
  const double left = scene.corners[0].x();
  for (const int beyond : {0, 2, 5, 12}) {
    const int cut = static_cast<int>(left) + beyond;
    const cv::Mat part = scene.grey(cv::Rect(cut, 0, scene.grey.cols - cut, scene.grey.rows)).clone();
    for (const auto& marker : detect_markers(part, ToneCurve::srgb, usual())) {
      EXPECT_EQ(marker.status, MarkerStatus::cut_by_frame) << beyond << " px beyond";
    }
  }
}

TEST(DetectMarkers, SaturatedIsNamed) {
  Scene scene = one_marker(usual().patterns[5], 90, 0.2, 0);
  scene.grey.convertTo(scene.grey, -1, 1.4, 0);
  EXPECT_EQ(status_of(scene.grey), MarkerStatus::saturated);
}

TEST(DetectMarkers, ToSteepIsNamed) {
  EXPECT_EQ(status_of(one_marker(usual().patterns[5], 300, 0.4, 78 * kRadPerDeg).grey),
            MarkerStatus::too_steep);
  EXPECT_EQ(status_of(one_marker(usual().patterns[5], 300, 0.4, 72 * kRadPerDeg).grey), MarkerStatus::ok);
}

TEST(DetectMarkers, SmallFromFourteenPixels) {
  const Scene scene = one_marker(usual().patterns[5], 14, 0.2, 0);
  EXPECT_EQ(status_of(scene.grey), MarkerStatus::ok);
}

TEST(DetectMarkers, TheSameIdTwiceIsTrustedInNeitherPlace) {
  const Scene scene = one_marker(usual().patterns[5], 60, 0.2, 0);
  cv::Mat twice;
  cv::hconcat(scene.grey, scene.grey, twice);
  const auto markers = detect_markers(twice, ToneCurve::srgb, usual());
  ASSERT_EQ(markers.size(), 2U);
  EXPECT_EQ(markers[0].status, MarkerStatus::duplicate);
  EXPECT_EQ(markers[1].status, MarkerStatus::duplicate);
}

TEST(DetectMarkers, CoveredCellsDoNotMoveTheCorners) {
  Scene scene = one_marker(usual().patterns[5], 120, 0, 0);
  // A pale stripe over two cells of the inside.
  cv::Mat(scene.grey, cv::Rect(static_cast<int>(scene.corners[0].x()) + 50,
                               static_cast<int>(scene.corners[0].y()) + 35, 14, 30))
      .setTo(170);
  const auto markers = detect_markers(scene.grey, ToneCurve::srgb, usual());
  ASSERT_EQ(markers.size(), 1U);
  EXPECT_LT(largest_error(markers[0], scene.corners), 0.05);
}

TEST(DetectMarkers, FlatPaperAndNoiseHoldNone) {
  cv::Mat grey(400, 400, CV_8UC1, cv::Scalar(140));
  EXPECT_TRUE(detect_markers(grey, ToneCurve::srgb, usual()).empty());
  cv::RNG random(7);
  random.fill(grey, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(grey, grey, {}, 3);
  cv::normalize(grey, grey, 0, 255, cv::NORM_MINMAX);
  EXPECT_TRUE(detect_markers(grey, ToneCurve::srgb, usual()).empty());
}

}  // namespace
}  // namespace hexcal
