#include "camera_calib/calibrate_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "camera_calib/camera_report.h"
#include "camera_calib/compare_cameras.h"
#include "camera_calib/projection_difference.h"
#include "kinematics/geometry/input_error.h"
#include "tests/support/synthetic_sheets.h"

namespace hexcal {
namespace {

const std::vector<Sheet>& sheets() {
  static const std::vector<Sheet> all{synthetic_aprilgrid()};
  return all;
}

CameraCalibration calibrate(const std::vector<SheetPhotograph>& photographs,
                            const CameraCalibrationOptions& options = {}) {
  const CameraCalibration rough = rough_calibration(sheets(), photographs, options);
  if (rough.status != CalibrationStatus::ok) return rough;
  return calibrate_camera(sheets(), rough.fit.adjustment.state, rough.fit.extra_sigma_px, options);
}

CameraCalibration calibrate(const SyntheticSheets& synthetic, const CameraCalibrationOptions& options = {}) {
  return calibrate(synthetic_photographs(sheets()[0], synthetic), options);
}

std::string words(const CameraReport& report) {
  std::string all;
  for (const Advice& advice : report.advice) all += advice.words + "\n";
  return all;
}

SyntheticSheets at_35_mm() {
  SyntheticSheets synthetic;
  synthetic.camera = profile_camera();
  synthetic.sigma_px = 0.01;
  return synthetic;
}

TEST(CalibrateCamera, EvidenceChoosesAModelThatFollowsTheLens) {
  const SyntheticSheets synthetic = at_35_mm();
  const auto photographs = synthetic_photographs(sheets()[0], synthetic);
  const CameraCalibration calibration = calibrate(photographs);
  ASSERT_EQ(calibration.status, CalibrationStatus::ok);
  EXPECT_LT(projection_difference(synthetic.camera, calibration.fit.adjustment.state.camera).rms_px, 0.01);
  EXPECT_NE(calibration.variant.board, BoardFreedom::points);
  const CameraReport report = report_calibration(sheets(), photographs, calibration);
  EXPECT_EQ(report.quality.verdict, CameraVerdict::good) << words(report);
  EXPECT_NEAR(report.quality.rms_px, 0.01 * std::sqrt(2.0), 0.002);
  EXPECT_NEAR(report.quality.sigma0, 1.0, 0.05);
  ASSERT_TRUE(report.halves);
  EXPECT_LT(report.halves->rms_px, 0.03);
}

TEST(CalibrateCamera, ReportSaysWhatATechnicianCanDo) {
  SyntheticSheets frontal = at_35_mm();
  frontal.tilt_deg = 4;
  auto photographs = synthetic_photographs(sheets()[0], frontal);
  CameraReport report = report_calibration(sheets(), photographs, calibrate(photographs));
  EXPECT_EQ(report.quality.verdict, CameraVerdict::retake);
  EXPECT_THAT(words(report), testing::HasSubstr("tilt the sheet 20 to 40 degrees"));

  SyntheticSheets few = at_35_mm();
  few.photographs = 3;
  photographs = synthetic_photographs(sheets()[0], few);
  report = report_calibration(sheets(), photographs, calibrate(photographs));
  EXPECT_EQ(report.quality.verdict, CameraVerdict::retake);
  EXPECT_THAT(words(report), testing::HasSubstr("only 3 photographs"));

  // Every tag of the lower left of the frame missing.
  photographs = synthetic_photographs(sheets()[0], at_35_mm());
  for (SheetPhotograph& photograph : photographs) {
    std::erase_if(photograph.features,
                  [](const FeatureObservation& f) { return f.px[0] < 1500 && f.px[1] > 2900; });
    for (FeatureObservation& f : photograph.features) f.blur_px = photograph.name == "photo5" ? 2.4 : 0.7;
  }
  report = report_calibration(sheets(), photographs, calibrate(photographs));
  EXPECT_THAT(words(report), testing::HasSubstr("bottom left edge"));
  EXPECT_THAT(words(report), testing::HasSubstr("photo5 is blurred (2.4 px)"));
}

TEST(CalibrateCamera, AWrongTagSizeIsNamed) {
  SyntheticSheets synthetic = at_35_mm();
  auto photographs = synthetic_photographs(sheets()[0], synthetic);
  // What the printer drew was a grid of the same pitch with larger tags.
  std::vector<Sheet> wrong = sheets();
  wrong[0].marker_mm = 39.2;
  wrong[0].spacing_mm = 15.8;
  const CameraCalibration rough = rough_calibration(wrong, photographs);
  ASSERT_EQ(rough.status, CalibrationStatus::ok);
  const CameraCalibration calibration =
      calibrate_camera(wrong, rough.fit.adjustment.state, rough.fit.extra_sigma_px,
                       {LensModel::brown, BoardFreedom::warped, {}});
  const CameraReport report = report_calibration(wrong, photographs, calibration);
  EXPECT_THAT(words(report), testing::HasSubstr("larger for their spacing than the template says"));
}

TEST(CalibrateCamera, RefusesWhatIsNoCalibration) {
  EXPECT_EQ(calibrate(std::vector<SheetPhotograph>{}).status, CalibrationStatus::no_sheet);
  SyntheticSheets two = at_35_mm();
  two.photographs = 2;
  const CameraCalibration calibration = calibrate(two);
  EXPECT_EQ(calibration.status, CalibrationStatus::too_few_photographs);
  EXPECT_THAT(calibration.reason, testing::HasSubstr("2 photographs"));
  EXPECT_NO_THROW(CameraCalibrationOptions{}.validate());
  CameraCalibrationOptions no_length;
  no_length.f_hint_px = -1;
  EXPECT_THROW(no_length.validate(), InputError);
}

// Over many calibrations the true error of projection divided by its predicted sigma has unit variance.
TEST(CalibrateCamera, PredictedUncertaintyIsTheErrorsUncertainty) {
  SyntheticSheets synthetic = at_35_mm();
  synthetic.photographs = 10;
  synthetic.sigma_px = 0;
  auto exact = synthetic_photographs(sheets()[0], synthetic);
  const CameraCalibration rough = rough_calibration(sheets(), exact);
  ASSERT_EQ(rough.status, CalibrationStatus::ok);
  SheetAdjustmentOptions options;
  options.free_parameters = {1, 0, 1, 1, 1, 1, 1, 0, 0, 0, 1, 1};
  double sums[3] = {0, 0, 0};
  constexpr int kRuns = 60;
  std::mt19937 random(3);
  for (int run = 0; run < kRuns; ++run) {
    auto photographs = exact;
    for (SheetPhotograph& photograph : photographs) {
      for (FeatureObservation& feature : photograph.features) {
        for (Eigen::Index i = 0; i < 8; ++i) feature.px[i] += 0.01 * gaussian(random);
      }
    }
    CalibrationState start = with_features(rough.fit.adjustment.state, photographs);
    start.camera = synthetic.camera;
    const SheetAdjustmentResult fit = adjust_sheets(sheets(), start, options);
    const ProjectionDifference error = projection_difference(synthetic.camera, fit.state.camera);
    const ProjectionUncertainty sigma = projection_uncertainty(fit.state.camera, fit.camera_covariance);
    const int cells[3][2] = {{15, 10}, {29, 10}, {29, 19}};  // centre, edge, corner
    for (int i = 0; i < 3; ++i) {
      const auto at = static_cast<std::size_t>(cells[i][1] * error.columns + cells[i][0]);
      const Eigen::Vector2d e = error.difference_px[at];
      sums[i] += e.dot(sigma.covariance_px2[at].inverse() * e) / 2;
    }
  }
  for (const double sum : sums) {
    EXPECT_GT(std::sqrt(sum / kRuns), 0.8);
    EXPECT_LT(std::sqrt(sum / kRuns), 1.25);
  }
}

TEST(CompareCameras, NoiseIsNotSignificantAnotherZoomIs) {
  const CameraCalibrationOptions radial{LensModel::radial, BoardFreedom::ideal, {}};
  const CameraCalibration one = calibrate(at_35_mm(), radial);
  SyntheticSheets again = at_35_mm();
  again.seed = 7;
  const CameraCalibration two = calibrate(again, radial);
  again.camera.parameters[0] *= 1.001;
  const CameraCalibration zoomed = calibrate(again, radial);
  const auto camera = [](const CameraCalibration& c) {
    return CalibratedCamera{c.fit.adjustment.state.camera, c.fit.adjustment.camera_covariance, {}, {}};
  };
  EXPECT_FALSE(compare_cameras(camera(one), camera(two)).significant);
  EXPECT_TRUE(compare_cameras(camera(one), camera(zoomed)).significant);
  CalibratedCamera small = camera(one);
  small.model.width_px = 3008;
  EXPECT_THROW((void)compare_cameras(camera(one), small), InputError);
}

}  // namespace
}  // namespace hexcal
