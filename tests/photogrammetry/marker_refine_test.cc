#include <gmock/gmock.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <numbers>

#include "kinematics/geometry/pose.h"
#include "photogrammetry/markers/refine.h"
#include "tests/support/marker_renderer.h"

namespace hexcal {
namespace {

using testing::flat_marker;
using testing::render_image;
using testing::square_corners;
using testing::TestImage;
using testing::tilted_square;

std::array<Eigen::Vector2d, 4> moved(std::array<Eigen::Vector2d, 4> corners, double px) {
  for (std::size_t i = 0; i < 4; ++i)
    corners[i] += Eigen::Vector2d(i % 2 == 0 ? px : -px, i < 2 ? -0.7 * px : px);
  return corners;
}

double rms_error(const MarkerObservation& marker, const std::array<Eigen::Vector2d, 4>& truth) {
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) sum += (marker.corners_px[i] - truth[i]).squaredNorm();
  return std::sqrt(sum / 8);
}

struct View {
  double side_px, tilt_deg, blur_px, budget_px;
};

class RefineMarkerWithoutNoise : public ::testing::TestWithParam<View> {};

// Only the rounding to 8 bits is left.
TEST_P(RefineMarkerWithoutNoise, IsExactToRounding) {
  const View view = GetParam();
  TestImage image;
  image.width_px = image.height_px = static_cast<int>(1.4 * view.side_px + 60);
  image.blur_px = view.blur_px;
  image.noise = 0;
  const Eigen::Vector2d centre(0.5 * image.width_px + 0.3, 0.5 * image.height_px - 0.4);
  const Eigen::Matrix3d square = tilted_square(centre, view.side_px, 0.3, view.tilt_deg * kRadPerDeg, 0.7);
  const MarkerPattern& pattern = marker_family("tag36h11").patterns[17];
  const cv::Mat grey = render_image(image, {flat_marker(pattern, square)});
  const MarkerObservation marker =
      refine_markers(grey, ToneResponse(ToneCurve::srgb), {{&pattern, moved(square_corners(square), 1.0)}})
          .markers.front();
  EXPECT_EQ(marker.status, MarkerStatus::ok);
  EXPECT_LT(rms_error(marker, square_corners(square)), view.budget_px);
  EXPECT_NEAR(marker.blur_px, view.blur_px, 0.02);
}

INSTANTIATE_TEST_SUITE_P(Views, RefineMarkerWithoutNoise,
                         ::testing::Values(View{100, 0, 0.7, 0.002}, View{100, 40, 0.5, 0.003},
                                           View{120, 73, 0.7, 0.004}, View{60, 60, 1.2, 0.004}));

TEST(RefineMarker, RefusesWhatIsNoMarker) {
  const cv::Mat grey(200, 200, CV_8UC1, cv::Scalar(128));
  const MarkerPattern& pattern = marker_family("tag36h11").patterns[0];
  const std::array<Eigen::Vector2d, 4> corners{Eigen::Vector2d(50, 50), Eigen::Vector2d(150, 50),
                                               Eigen::Vector2d(150, 150), Eigen::Vector2d(50, 150)};
  const MarkerObservation marker =
      refine_markers(grey, ToneResponse(ToneCurve::srgb), {{&pattern, corners}}).markers.front();
  EXPECT_NE(marker.status, MarkerStatus::ok);
}

}  // namespace
}  // namespace hexcal
