#include "tools/report/camera_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/synthetic_sheets.h"

namespace hexcal {
namespace {

std::string page_of_photographs(int count) {
  const std::vector<Sheet> sheets{synthetic_aprilgrid()};
  SyntheticSheets synthetic;
  synthetic.camera = profile_camera();
  synthetic.sigma_px = 0.01;
  synthetic.photographs = count;
  const auto photographs = synthetic_photographs(sheets[0], synthetic);
  const CameraCalibration rough = rough_calibration(sheets, photographs);
  const CameraCalibration calibration =
      calibrate_camera(sheets, rough.fit.adjustment.state, rough.fit.extra_sigma_px,
                       {LensModel::radial, BoardFreedom::ideal, {}});
  const CameraReport report = report_calibration(sheets, photographs, calibration);
  return render_camera_page(sheets, calibration, "camera.yaml", {}, report);
}

TEST(CameraPage, HoldsVerdictMapsPhotographsAndModels) {
  const std::string page = page_of_photographs(8);
  EXPECT_THAT(page, testing::HasSubstr("Uncertainty of projection"));
  EXPECT_THAT(page, testing::HasSubstr("photo7"));
  EXPECT_THAT(page, testing::HasSubstr("radial a1"));
  EXPECT_THAT(page, testing::HasSubstr("8 photographs are few"));
}

TEST(CameraPage, SaysThatAGoodCameraIsGood) {
  EXPECT_THAT(page_of_photographs(14), testing::HasSubstr("The camera is good: use it."));
}

TEST(CameraPage, AFailedCalibrationStillHasAPage) {
  CameraCalibration failed;
  failed.reason = "no sheet was found in any photograph";
  const CameraReport report = report_calibration({synthetic_aprilgrid()}, {}, failed);
  EXPECT_THAT(render_camera_page({synthetic_aprilgrid()}, failed, "", {}, report),
              testing::HasSubstr("no sheet was found in any photograph"));
}

}  // namespace
}  // namespace hexcal
