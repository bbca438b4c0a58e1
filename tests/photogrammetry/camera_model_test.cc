#include "photogrammetry/camera/camera_model.h"

#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>
#include <random>

namespace hexcal {
namespace {

CameraModel example(LensModel lens) {
  CameraModel camera(6016, 4000, 9011.1, lens);
  camera.parameters[1] = 3e-4;
  camera.parameters[2] += 21.5;
  camera.parameters[3] -= 13.25;
  auto k = camera.parameters.tail(camera.parameters.size() - CameraModel::kNumPinhole);
  switch (lens) {
    case LensModel::brown:
      k << -0.11, 0.31, 4e-4, -7e-4, -0.2;
      break;
    case LensModel::rational:
      k << -0.11, 0.31, 4e-4, -7e-4, -0.2, 0.05, 0.02, -0.03, 3e-4, -1e-4, 2e-4, 5e-5;
      break;
    case LensModel::radial:
      k << 0.004, 0.06, -0.08, 0.5, -0.3, 0.1, 4e-4, -7e-4;
      break;
  }
  return camera;
}

class EveryLens : public testing::TestWithParam<LensModel> {};

TEST_P(EveryLens, AgreesWithOpenCv) {
  const CameraModel camera = example(GetParam());
  if (camera.lens == LensModel::radial) GTEST_SKIP() << "OpenCV has no such model";
  const cv::Matx33d matrix(camera.fx_px(), 0, camera.cx_px(), 0, camera.fy_px(), camera.cy_px(), 0, 0, 1);
  std::vector<double> distortion(camera.parameters.data() + CameraModel::kNumPinhole,
                                 camera.parameters.data() + camera.parameters.size());
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-0.4, 0.4);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d point(uniform(random) * 700, uniform(random) * 700, 700 + 100 * uniform(random));
    std::vector<cv::Point2d> px;
    cv::projectPoints(std::vector<cv::Point3d>{{point.x(), point.y(), point.z()}}, cv::Vec3d(), cv::Vec3d(),
                      matrix, distortion, px);
    const auto ours = camera.project(point);
    ASSERT_TRUE(ours);
    EXPECT_LT((*ours - Eigen::Vector2d(px[0].x, px[0].y)).norm(), 1e-8);
  }
}

TEST_P(EveryLens, JacobiansAgreeWithDifferences) {
  const CameraModel camera = example(GetParam());
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-0.35, 0.35);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector2d n(uniform(random), uniform(random));
    Eigen::Matrix2d by_point;
    CameraModel::ByParameters by_parameters;
    (void)camera.image_from_normalised(n, &by_point, &by_parameters);
    for (int j = 0; j < 2; ++j) {
      const Eigen::Vector2d h = 1e-6 * Eigen::Vector2d::Unit(j);
      const Eigen::Vector2d numeric =
          (camera.image_from_normalised(n + h) - camera.image_from_normalised(n - h)) / 2e-6;
      EXPECT_LT((numeric - by_point.col(j)).norm(), 1e-4 * (1 + numeric.norm()) * 1e-2);
    }
    for (Eigen::Index j = 0; j < camera.parameters.size(); ++j) {
      CameraModel more = camera;
      CameraModel less = camera;
      const double h = 1e-6 * std::max(1.0, std::abs(camera.parameters[j]));
      more.parameters[j] += h;
      less.parameters[j] -= h;
      const Eigen::Vector2d numeric =
          (more.image_from_normalised(n) - less.image_from_normalised(n)) / (2 * h);
      EXPECT_LT((numeric - by_parameters.col(j)).norm(), 1e-6 * (1 + numeric.norm())) << "parameter " << j;
    }
  }
}

TEST_P(EveryLens, InverseUndoesTheLensOverTheFrame) {
  const CameraModel camera = example(GetParam());
  for (double x = 0; x < camera.width_px; x += 500) {
    for (double y = 0; y < camera.height_px; y += 500) {
      const auto n = camera.normalised_from_image({x, y});
      ASSERT_TRUE(n) << x << ", " << y;
      EXPECT_LT((camera.image_from_normalised(*n) - Eigen::Vector2d(x, y)).norm(), 1e-8);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(CameraModel, EveryLens,
                         testing::Values(LensModel::brown, LensModel::rational, LensModel::radial));

TEST(CameraModel, GivesNothingBehindTheCameraOrBeyondItsRadius) {
  CameraModel camera = example(LensModel::brown);
  EXPECT_FALSE(camera.project({0, 0, -1}));
  camera.valid_radius = 0.4;
  EXPECT_TRUE(camera.project({0.3, 0, 1}));
  EXPECT_FALSE(camera.project({0.5, 0, 1}));
}

TEST(CameraModel, FoldedModelHasNoInverse) {
  CameraModel camera(640, 480, 300, LensModel::brown);
  camera.parameters[4] = -1.0;  // r (1 - r^2) turns back at r = 0.58, image radius 115 px
  EXPECT_FALSE(camera.normalised_from_image({639, 479}));
}

}  // namespace
}  // namespace hexcal
