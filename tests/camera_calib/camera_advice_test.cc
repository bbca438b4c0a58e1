#include "camera_calib/camera_advice.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "camera_calib/camera_report.h"
#include "tests/support/synthetic_sheets.h"

namespace hexcal {
namespace {

using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;

struct AdvisedScene {
  SyntheticSheets synthetic;
  std::vector<Sheet> sheets{synthetic_aprilgrid()};
  std::vector<SheetPhotograph> photographs;
  CameraCalibration calibration;

  AdvisedScene() {
    synthetic.camera = profile_camera();
    synthetic.sigma_px = 0.01;
    take();
  }
  void take() { photographs = synthetic_photographs(sheets[0], synthetic); }
  /// Every photograph of its own scene, which `change` makes of the common one.
  template <typename Change>
  void take_each(Change change) {
    const SyntheticSheets common = synthetic;
    for (std::size_t p = 0; p < photographs.size(); ++p) {
      synthetic = common;
      change(p, synthetic);
      photographs[p] = synthetic_photographs(sheets[0], synthetic)[p];
    }
    synthetic = common;
  }
  [[nodiscard]] CameraReport report(BoardFreedom board = BoardFreedom::ideal) {
    const CameraCalibrationOptions options{LensModel::radial, board, {}};
    calibration = rough_calibration(sheets, photographs, options);
    if (calibration.status == CalibrationStatus::ok) {
      const RobustFitResult rough = calibration.fit;
      calibration = calibrate_camera(sheets, rough.adjustment.state, rough.extra_sigma_px, options);
    }
    return report_calibration(sheets, photographs, calibration);
  }
};

std::string advice_words(const CameraReport& report, AdviceLevel level) {
  std::string all;
  for (const Advice& advice : report.advice)
    if (advice.level == level) all += advice.words + "\n";
  return all;
}

TEST(CameraAdvice, ALittleTiltIsSaidInDegrees) {
  AdvisedScene scene;
  scene.synthetic.tilt_deg = 15;
  scene.take();
  const CameraReport report = scene.report();
  EXPECT_EQ(report.quality.verdict, CameraVerdict::usable);
  EXPECT_THAT(advice_words(report, AdviceLevel::usable),
              HasSubstr("no photograph is tilted more than 15 degrees: tilt the sheet 20 to 40 degrees"));
}

TEST(CameraAdvice, BlurAndAPhotographByAnotherLensAreNamed) {
  AdvisedScene scene;
  scene.take_each([](std::size_t p, SyntheticSheets& synthetic) {
    if (p != 5) return;
    synthetic.camera.parameters[0] *= 1.2;
    synthetic.camera.parameters[CameraModel::kNumPinhole + 1] *= 8;
  });
  for (SheetPhotograph& photograph : scene.photographs)
    for (FeatureObservation& feature : photograph.features) feature.blur_px = 2;
  for (FeatureObservation& feature : scene.photographs[7].features) feature.status = MarkerStatus::saturated;
  const CameraReport report = scene.report();
  EXPECT_EQ(report.quality.photographs, 12);
  EXPECT_THAT(advice_words(report, AdviceLevel::usable),
              HasSubstr("all photographs are blurred (usually 2.0 px): focus on the sheet"));
  EXPECT_THAT(advice_words(report, AdviceLevel::note),
              AllOf(HasSubstr("photo5: does not fit the others: another zoom setting"),
                    HasSubstr("photo7: too few points of a sheet can be measured")));
}

TEST(CameraAdvice, ManyOutliersAreCounted) {
  AdvisedScene scene;
  int wrong = 0;
  int all = 0;
  for (SheetPhotograph& photograph : scene.photographs) {
    for (std::size_t f = 0; f < photograph.features.size(); ++f) {
      all += 4;
      if (f % 6 != 0) continue;
      photograph.features[f].px[2] += 2;
      wrong += 4;
    }
  }
  EXPECT_THAT(advice_words(scene.report(), AdviceLevel::usable),
              HasSubstr(fmt::format("{} of {} points are outliers", wrong, all)));
}

TEST(CameraAdvice, ABentAndStretchedPrintIsDescribed) {
  AdvisedScene scene;
  scene.synthetic.shape.deformation << 0.003, 0, 3.0, 0, 0;
  scene.take();
  EXPECT_THAT(advice_words(scene.report(BoardFreedom::warped), AdviceLevel::note),
              AllOf(HasSubstr("the sheet is out of flatness by 3.0 mm; the camera was freed of it"),
                    HasSubstr("the sheet is printed 0.30 % too long in x; the camera was freed of it")));
}

TEST(CameraAdvice, ALensThatChangedBetweenPhotographsShows) {
  AdvisedScene bent;
  bent.take_each([](std::size_t p, SyntheticSheets& synthetic) {
    if (p % 2 == 1) synthetic.camera.parameters[CameraModel::kNumPinhole] += 0.02;
  });
  EXPECT_THAT(
      advice_words(bent.report(), AdviceLevel::usable),
      ContainsRegex("the photographs disagree about the camera [0-9]+ times more than their noise, and "
                    "the sigmas are widened by it"));
  AdvisedScene zoomed;
  zoomed.take_each([](std::size_t p, SyntheticSheets& synthetic) {
    if (p % 2 == 1) synthetic.camera.parameters[0] *= 1.002;
  });
  EXPECT_THAT(
      advice_words(zoomed.report(), AdviceLevel::usable),
      ContainsRegex("two halves of the photographs give cameras that differ by [0-9.]+ px rms, more than "
                    "their noise explains"));
}

TEST(CameraAdvice, PhotographsOfNoSheetAreNoCamera) {
  AdvisedScene scene;
  const std::vector<SheetPoint> points = sheet_points(sheet_geometry(scene.sheets[0]));
  // A plane whose horizon crosses the sheet: half of it would lie behind the camera.
  for (SheetPhotograph& photograph : scene.photographs) {
    for (FeatureObservation& feature : photograph.features) {
      for (Eigen::Index i = 0; i < 4; ++i) {
        const Eigen::Vector2d at =
            points[static_cast<std::size_t>(feature.first_point + i)].position_mm.head<2>();
        feature.px.segment<2>(2 * i) = Eigen::Vector2d(3000, 2000) + 10 * at / (1 + at.x() / 97);
      }
    }
  }
  EXPECT_THAT(advice_words(scene.report(), AdviceLevel::retake),
              HasSubstr("the adjustment found no camera that fits these photographs"));
  EXPECT_EQ(scene.calibration.status, CalibrationStatus::no_solution);
}

TEST(CameraAdvice, ACalibrationNeedsViewsBeforeTheCamera) {
  AdvisedScene scene;
  const CameraCalibrationOptions options{LensModel::radial, BoardFreedom::ideal, {}};
  const CalibrationState good = rough_calibration(scene.sheets, scene.photographs).fit.adjustment.state;
  ASSERT_EQ(good.views.size(), 14U);
  CalibrationState behind = good;
  for (SheetView& view : behind.views) view.camera_from_sheet.translation.z() *= -1;
  CameraCalibration calibration = calibrate_camera(scene.sheets, behind, 0.02, options);
  EXPECT_EQ(calibration.status, CalibrationStatus::no_solution);
  EXPECT_EQ(calibration.reason, "the adjustment found no camera that fits these photographs");
  CalibrationState two = good;
  two.views.resize(2);
  calibration = calibrate_camera(scene.sheets, two, 0.02, options);
  EXPECT_EQ(calibration.status, CalibrationStatus::too_few_photographs);
  EXPECT_EQ(calibration.reason, "fewer than 3 photographs, wanted at least 3 and better 10 to 20");
}

}  // namespace
}  // namespace hexcal
