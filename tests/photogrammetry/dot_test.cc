#include <gmock/gmock.h>

#include <Eigen/Geometry>

#include "photogrammetry/markers/refine.h"
#include "tests/support/marker_renderer.h"

namespace hexcal {
namespace {

using testing::FlatPattern;
using testing::TestImage;

// A black disc of radius 1, edges softened over the box it is averaged over.
FlatPattern disc(const Eigen::Matrix3d& image_from_plane) {
  return {[](const Eigen::Vector2d& t, const Eigen::Vector2d& half) {
            const double width = half.dot(t.cwiseAbs()) / std::max(t.norm(), 1e-9);
            return std::clamp(0.5 + 0.5 * (t.norm() - 1) / std::max(width, 1e-9), 0.0, 1.0);
          },
          image_from_plane};
}

struct Case {
  double noise, budget_px;
};

class RefineDot : public ::testing::TestWithParam<Case> {};

// A steep view close by: the middle of the disc's image is 0.3 px away from the image of its middle.
TEST_P(RefineDot, FindsTheImageOfTheTrueCentre) {
  TestImage image;
  image.width_px = image.height_px = 120;
  image.noise = GetParam().noise;
  image.oversampling = 12;
  const Eigen::Matrix3d plane = testing::tilted_square({60.2, 59.7}, 60, 0.3, 1.0, 0.4, 800);
  const cv::Mat grey = testing::render_image(image, {disc(plane)});
  const Eigen::Vector2d truth = (plane * Eigen::Vector3d(0, 0, 1)).hnormalized();
  const PointObservation point = refine_dot(grey, ToneCurve::srgb, plane, Eigen::Vector2d(0.03, -0.04), 1.05);
  EXPECT_EQ(point.status, MarkerStatus::ok);
  EXPECT_LT((point.px - truth).norm(), GetParam().budget_px);
  EXPECT_NEAR(point.blur_px, image.blur_px, 0.05);
}

INSTANTIATE_TEST_SUITE_P(Noise, RefineDot, ::testing::Values(Case{0, 0.01}, Case{2, 0.05}));

TEST(RefineDot, RefusesFlatPaper) {
  const cv::Mat grey(100, 100, CV_8UC1, cv::Scalar(128));
  const Eigen::Matrix3d plane = testing::tilted_square({50, 50}, 40, 0, 0, 0);
  EXPECT_NE(refine_dot(grey, ToneCurve::srgb, plane, {0, 0}, 1).status, MarkerStatus::ok);
}

}  // namespace
}  // namespace hexcal
