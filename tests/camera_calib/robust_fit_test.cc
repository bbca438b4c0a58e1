#include "camera_calib/robust_fit.h"

#include <gtest/gtest.h>

#include "camera_calib/initial_camera.h"
#include "camera_calib/projection_difference.h"
#include "tests/support/synthetic_sheets.h"

namespace hexcal {
namespace {

RobustFitResult fit(const SyntheticSheets& synthetic, const CameraVariant& variant,
                    std::vector<SheetPhotograph> photographs = {}) {
  const std::vector<Sheet> sheets{synthetic_aprilgrid()};
  if (photographs.empty()) photographs = synthetic_photographs(sheets[0], synthetic);
  const CalibrationState start =
      initial_state(sheets, photographs, synthetic.camera.width_px, synthetic.camera.height_px, std::nullopt);
  const RobustFitResult first = first_fit(sheets, start);
  return robust_fit(sheets, first.adjustment.state, variant, first.extra_sigma_px);
}

TEST(InitialCamera, FocalLengthWithoutAGuess) {
  SyntheticSheets synthetic;
  synthetic.camera = profile_camera();
  const std::vector<Sheet> sheets{synthetic_aprilgrid()};
  const auto photographs = synthetic_photographs(sheets[0], synthetic);
  const CalibrationState start = initial_state(sheets, photographs, 6016, 4000, std::nullopt);
  EXPECT_EQ(start.views.size(), 14u);
  EXPECT_NEAR(start.camera.fy_px(), 9011, 600);
}

TEST(InitialCamera, NoHomographyFromPointsOnALine) {
  std::vector<Eigen::Vector2d> sheet;
  std::vector<Eigen::Vector2d> image;
  for (int i = 0; i < 8; ++i) {
    sheet.emplace_back(10 * i, 5 * i);
    image.emplace_back(100 + 20 * i, 300 - 7 * i);
  }
  EXPECT_FALSE(homography_from_points(sheet, image));
}

TEST(RobustFit, ExactWithoutNoise) {
  SyntheticSheets synthetic;
  synthetic.camera = profile_camera();
  const RobustFitResult result = fit(synthetic, {LensModel::radial, {}, BoardFreedom::ideal});
  ASSERT_TRUE(result.adjustment.converged);
  EXPECT_LT(projection_difference(synthetic.camera, result.adjustment.state.camera).max_px, 1e-4);
  EXPECT_LT(result.extra_sigma_px, 1e-9);
}

TEST(RobustFit, OutliersAreFoundAndOnlyThey) {
  SyntheticSheets synthetic;
  synthetic.camera = profile_camera();
  synthetic.sigma_px = 0.02;
  auto photographs = synthetic_photographs(synthetic_aprilgrid(), synthetic);
  for (std::size_t p = 0; p < photographs.size(); p += 2) photographs[p].features[3].px[5] += 0.5;
  const RobustFitResult result = fit(synthetic, {LensModel::radial, {}, BoardFreedom::ideal}, photographs);
  int rejected = 0;
  for (const SheetView& view : result.adjustment.state.views) {
    for (std::size_t f = 0; f < view.rejected.size(); ++f) {
      if (view.rejected[f] == 0) continue;
      ++rejected;
      EXPECT_EQ(f, 3u);
    }
  }
  EXPECT_EQ(rejected, 7);
  EXPECT_LT(projection_difference(synthetic.camera, result.adjustment.state.camera).rms_px, 0.03);
}

TEST(RobustFit, AWarpedAndStretchedPrintDoesNotBendTheCamera) {
  SyntheticSheets synthetic;
  synthetic.camera = profile_camera();
  synthetic.sigma_px = 0.01;
  synthetic.shape.deformation << 0.003, 0.0005, 1.0, -0.2, 0.4;
  const RobustFitResult warped = fit(synthetic, {LensModel::radial, {}, BoardFreedom::warped});
  EXPECT_LT(projection_difference(synthetic.camera, warped.adjustment.state.camera).rms_px, 0.03);
  EXPECT_NEAR(warped.adjustment.state.shapes[0].deformation[0], 0.003, 2e-5);
  EXPECT_NEAR(warped.adjustment.state.shapes[0].deformation[2], 1.0, 0.02);
  const RobustFitResult points = fit(synthetic, {LensModel::radial, {}, BoardFreedom::points});
  EXPECT_LT(projection_difference(synthetic.camera, points.adjustment.state.camera).rms_px, 0.05);
  EXPECT_LT(points.extra_sigma_px, 0.004);
}

TEST(RobustFit, NoiseThatTheCovariancesDoNotStateIsEstimated) {
  SyntheticSheets synthetic;
  synthetic.camera = profile_camera();
  synthetic.sigma_px = 0.05;
  auto photographs = synthetic_photographs(synthetic_aprilgrid(), synthetic);
  for (SheetPhotograph& photograph : photographs) {
    for (FeatureObservation& feature : photograph.features) feature.covariance_px2 *= 0.01;
  }
  const RobustFitResult result = fit(synthetic, {LensModel::radial, {}, BoardFreedom::ideal}, photographs);
  EXPECT_NEAR(result.extra_sigma_px, 0.05, 0.004);
  EXPECT_NEAR(result.adjustment.sigma0(), 1.0, 0.05);
}

TEST(RobustFit, ConvertedCameraIsNearEnoughToStartFrom) {
  for (const LensModel from : {LensModel::brown, LensModel::radial}) {
    CameraModel camera = profile_camera();
    if (from == LensModel::brown) {
      camera = CameraModel(6016, 4000, 9000, LensModel::brown);
      camera.parameters.tail<5>() << -0.1, 0.05, 1e-4, 2e-4, 0.01;
    }
    for (const LensModel to : {LensModel::brown, LensModel::rational, LensModel::radial}) {
      EXPECT_LT(projection_difference(camera, converted_camera(camera, to)).rms_px, 1.0);
    }
  }
}

}  // namespace
}  // namespace hexcal
