#include "photogrammetry/markers/edge_fit.h"

#include <gmock/gmock.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "photogrammetry/markers/marker.h"
#include "tests/support/marker_renderer.h"

namespace hexcal {
namespace {

using testing::flat_marker;
using testing::render_image;
using testing::square_corners;
using testing::TestImage;
using testing::tilted_square;

const MarkerPattern& pattern() { return marker_family("tag36h11").patterns[9]; }

Eigen::Matrix3d square(int number) {
  return tilted_square({90.3, 89.6}, 100, 0.3 + 0.4 * number, 0.1 * number, 0.7);
}

cv::Mat photograph(int number, double noise) {
  TestImage image;
  image.width_px = image.height_px = 180;
  image.noise = noise;
  image.seed = static_cast<std::uint64_t>(number + 1);
  return render_image(image, {flat_marker(pattern(), square(number))});
}

EdgeFit fit(const cv::Mat& grey, int number) {
  std::array<Eigen::Vector2d, 4> corners = square_corners(square(number));
  for (std::size_t i = 0; i < 4; ++i) corners[i] += Eigen::Vector2d(i % 2 == 0 ? 0.8 : -0.6, 0.5);
  return fit_edges(grey, PixelMap(grey.cols, grey.rows, {}), BlurredPattern(pattern()),
                   pattern().square_cells, corners);
}

Eigen::Matrix<double, 8, 1> error_of(const EdgeFit& fitted, int number) {
  const std::array<Eigen::Vector2d, 4> truth = square_corners(square(number));
  Eigen::Matrix<double, 8, 1> error;
  for (int i = 0; i < 4; ++i) {
    error.segment<2>(2 * i) =
        fitted.corners_px[static_cast<std::size_t>(i)] - truth[static_cast<std::size_t>(i)];
  }
  return error;
}

// Only interpolation between pixels is left; the curve moves every edge towards black, which is no size.
TEST(FitEdges, AreInPlaceWithoutNoise) {
  const EdgeFit fitted = fit(photograph(0, 0), 0);
  ASSERT_TRUE(fitted.converged);
  EXPECT_LT(error_of(fitted, 0).cwiseAbs().maxCoeff(), 0.06);
  EXPECT_GT(fitted.bleed_px, 0.1);
  EXPECT_GT(fitted.visible, 0.95);
}

TEST(FitEdges, StateWhatTheyAreOffBy) {
  double sum = 0;
  for (int number = 0; number < 6; ++number) {
    const EdgeFit fitted = fit(photograph(number, 4), number);
    ASSERT_TRUE(fitted.converged);
    const Eigen::Matrix<double, 8, 1> error = error_of(fitted, number);
    EXPECT_LT(error.cwiseAbs().maxCoeff(), 0.15);
    sum += error.dot(fitted.covariance_px2.ldlt().solve(error)) / 8;
  }
  EXPECT_GT(sum / 6, 0.3);
  EXPECT_LT(sum / 6, 2);
}

TEST(FitEdges, SayWhenThereAreNone) {
  EXPECT_FALSE(fit(cv::Mat(180, 180, CV_8UC1, cv::Scalar(128)), 0).converged);
  cv::Mat half = photograph(0, 1);
  half(cv::Rect(0, 0, 180, 95)).setTo(100);
  const EdgeFit fitted = fit(half, 0);
  EXPECT_TRUE(!fitted.converged || fitted.visible < 0.6) << fitted.visible;
}

}  // namespace
}  // namespace hexcal
