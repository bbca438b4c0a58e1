#include "camera_calib/measure_camera.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <exiv2/exiv2.hpp>
#include <opencv2/imgcodecs.hpp>

#include "camera_calib/detect_sheets.h"
#include "camera_calib/find_chessboard.h"
#include "kinematics/geometry/pose.h"
#include "tests/support/sheet_photographs.h"
#include "tests/support/temporary_folder.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

// The whole sheet before the camera, tilted 25 degrees about changing axes, every third one turned.
Rigid3 whole_sheet_view(const Sheet& sheet, const CameraModel& camera, int number) {
  const double about = 2.399963 * number;
  const Eigen::Vector3d tilt = 25 * kRadPerDeg * Eigen::Vector3d(std::cos(about), std::sin(about), 0);
  const Eigen::Quaterniond facing(0, 1, 0, 0);  // half a turn about x: the sheet's z looks at the camera
  const double turn = (number % 3 == 2 ? 90 : 0) * kRadPerDeg;
  const double distance = camera.fx_px() * sheet_geometry(sheet).extent_mm.x() / (0.6 * camera.width_px);
  return {quaternion_from_rotation_vector(tilt) * facing * quaternion_from_rpy({0, 0, turn}),
          Eigen::Vector3d(4 * std::cos(about), 3 * std::sin(about), distance)};
}

Sheet sheet_of(SheetKind kind) {
  Sheet sheet;
  sheet.kind = kind;
  sheet.columns = kind == SheetKind::dots ? 9 : 10;
  sheet.rows = 7;
  sheet.pitch_mm = kind == SheetKind::dots ? 15 : 20;
  sheet.dot_mm = kind == SheetKind::dots ? 6 : 4.5;
  sheet.marker_mm = kind == SheetKind::dots ? 13 : 15;
  if (kind == SheetKind::dots) sheet.family = "tag36h11";
  sheet.validate();
  return sheet;
}

Sheet tag_grid_from(int first_id) {
  Sheet sheet;
  sheet.family = "tag36h11";
  sheet.columns = 4;
  sheet.rows = 3;
  sheet.marker_mm = 40;
  sheet.spacing_mm = 15;
  sheet.first_id = first_id;
  return sheet;
}

struct PhotographedKind {
  SheetKind kind;
  double white;  ///< more than 1: overexposed paper, which only the coarser measurements stand
  double budget_px;
};

void PrintTo(const PhotographedKind& one, std::ostream* out) {
  *out << sheet_kind_name(one.kind) << (one.white > 1 ? "_overexposed" : "");
}

class PhotographedSheet : public ::testing::TestWithParam<PhotographedKind> {};

TEST_P(PhotographedSheet, GivesTheCameraThatTookIt) {
  const Sheet sheet = sheet_of(GetParam().kind);
  const CameraModel camera(720, 540, 780);
  const TemporaryFolder folder;
  std::vector<fs::path> paths;
  SheetLight light;
  light.white = GetParam().white;
  for (int i = 0; i < 6; ++i) {
    const Rigid3 view = whole_sheet_view(sheet, camera, i);
    paths.push_back(folder.path() / fmt::format("{}.png", i));
    cv::imwrite(paths.back().string(), sheet_photograph(sheet, camera, view, light, 1 + i));
  }
  const MeasuredCamera measured = measure_camera(paths, {sheet}, {LensModel::brown, BoardFreedom::ideal, {}});
  ASSERT_EQ(measured.calibration.status, CalibrationStatus::ok) << measured.calibration.reason;
  const SheetAdjustmentResult& fit = measured.calibration.fit.adjustment;
  ASSERT_EQ(fit.state.views.size(), 6U);
  std::size_t used = 0;
  for (const SheetView& view : fit.state.views) {
    for (std::size_t f = 0; f < view.features.size(); ++f)
      used += view.rejected[f] == 0 ? static_cast<std::size_t>(view.features[f].points()) : 0;
  }
  EXPECT_GE(used, 6 * sheet_points(sheet_geometry(sheet)).size() * 9 / 10);
  EXPECT_LT(fit.rms_px(), GetParam().budget_px);
  EXPECT_NEAR(fit.state.camera.fx_px(), camera.fx_px(), 4 * std::sqrt(fit.camera_covariance(0, 0)));
}

INSTANTIATE_TEST_SUITE_P(Kinds, PhotographedSheet,
                         ::testing::Values(PhotographedKind{SheetKind::dots, 0.7, 0.05},
                                           PhotographedKind{SheetKind::photomodeler, 0.7, 0.02},
                                           PhotographedKind{SheetKind::photomodeler, 1.2, 0.03},
                                           PhotographedKind{SheetKind::chessboard, 1.2, 0.08}));

void expect_nothing_found(const Sheet& sheet, const cv::Mat& grey, const std::string& words) {
  const SheetDetection detection = detect_sheets(grey, ToneCurve::srgb, {sheet});
  EXPECT_TRUE(std::none_of(detection.features.begin(), detection.features.end(),
                           [](const FeatureObservation& f) { return f.status == MarkerStatus::ok; }));
  EXPECT_EQ(detection.reason, words);
}

// For descriptions that count corners instead of squares, or are off by one.
TEST(DetectSheets, TheSizeOfAnyChessboardIsTold) {
  const Sheet printed = sheet_of(SheetKind::chessboard);
  const CameraModel camera(720, 540, 780);
  for (const int view : {0, 1, 2}) {
    const cv::Mat grey = sheet_photograph(printed, camera, whole_sheet_view(printed, camera, view), {}, 3);
    EXPECT_EQ(chessboard_size(grey), std::pair(printed.columns, printed.rows)) << view;
  }
  EXPECT_FALSE(chessboard_size(cv::Mat(540, 720, CV_8UC1, cv::Scalar(180))));
}

TEST(DetectSheets, SaysWhatIsNotThere) {
  const CameraModel camera(640, 480, 700);
  const cv::Mat paper(camera.height_px, camera.width_px, CV_8UC1, cv::Scalar(180));
  expect_nothing_found(sheet_of(SheetKind::photomodeler), paper, "the four ringed dots were not found");
  expect_nothing_found(sheet_of(SheetKind::chessboard), paper, "the whole chessboard was not found");
  expect_nothing_found(tag_grid_from(0), paper, "no sheet was found");
}

Sheet charuco_board() {
  Sheet sheet;
  sheet.kind = SheetKind::charuco;
  sheet.family = "DICT_4X4_50";
  sheet.columns = 9;
  sheet.rows = 6;
  sheet.pitch_mm = 16;
  sheet.marker_mm = 12;
  return sheet;
}

// Overexposed paper, and a false read beside the board.
TEST(DetectSheets, FindsEveryCornerOfACharuco) {
  const CameraModel camera(720, 540, 780);
  const Sheet sheet = charuco_board();
  SheetLight light;
  light.white = 1.2;
  cv::Mat grey = sheet_photograph(sheet, camera, whole_sheet_view(sheet, camera, 0), light);
  const cv::Mat again = grey(cv::Rect(330, 240, 60, 60)).clone();  // a marker of the board
  again.copyTo(grey(cv::Rect(4, 4, 60, 60)));
  const SheetDetection detection = detect_sheets(grey, ToneCurve::srgb, {sheet});
  const auto usable = std::count_if(
      detection.features.begin(), detection.features.end(),
      [](const FeatureObservation& f) { return f.status == MarkerStatus::ok && f.points() == 1; });
  EXPECT_EQ(usable, 40);
  EXPECT_EQ(detection.reason, "");
}

// Read by another template, whose markers stand where this board's squares are black.
TEST(DetectSheets, RefusesABoardWhoseMarkersDoNotLieAsTheTemplateSays) {
  const CameraModel camera(720, 540, 780);
  Sheet sheet = charuco_board();
  sheet.columns = 8;  // an odd number would be the same board moved by a square
  Sheet other = sheet;
  other.top_left_white = true;
  const cv::Mat grey = sheet_photograph(sheet, camera, whole_sheet_view(sheet, camera, 0));
  const SheetDetection detection = detect_sheets(grey, ToneCurve::srgb, {other});
  EXPECT_TRUE(std::none_of(detection.features.begin(), detection.features.end(),
                           [](const FeatureObservation& f) { return f.status == MarkerStatus::ok; }));
  EXPECT_THAT(detection.reason, ::testing::HasSubstr("the template says"));
}

TEST(MeasureCamera, LeavesOutPhotographsOfAnotherSettingAndOfAnotherSheet) {
  const Sheet sheet = tag_grid_from(0);
  const CameraModel camera(640, 480, 700);
  const TemporaryFolder folder;
  std::vector<fs::path> paths;
  for (int i = 0; i < 6; ++i) {
    const Sheet& seen = i == 3 ? tag_grid_from(100) : sheet;
    cv::Mat grey = sheet_photograph(seen, camera, whole_sheet_view(sheet, camera, i));
    if (i == 4) cv::resize(grey, grey, {560, 420});
    paths.push_back(folder.path() / fmt::format("{}.jpg", i));
    ASSERT_TRUE(cv::imwrite(paths.back().string(), grey, {cv::IMWRITE_JPEG_QUALITY, 98}));
    const auto image = Exiv2::ImageFactory::open(paths.back().string());
    image->exifData()["Exif.Photo.FocalLength"] = Exiv2::Rational(i == 5 ? 50 : 35, 1);
    image->writeMetadata();
  }
  const MeasuredCamera measured = measure_camera(paths, {sheet}, {LensModel::brown, BoardFreedom::ideal, {}});
  EXPECT_EQ(measured.calibration.status, CalibrationStatus::ok) << measured.calibration.reason;
  EXPECT_EQ(measured.calibration.fit.adjustment.state.views.size(), 3U);
  const std::vector<std::string> reasons{
      "",
      "",
      "",
      "ids 100 to 111 are on no sheet of the template: check first_id and family",
      "is 560 x 420 px, the others 640 x 480 px: resized, cropped or turned by a program",
      "was taken at 50 mm, the others at 35 mm: one zoom setting is one camera"};
  for (std::size_t i = 0; i < reasons.size(); ++i) {
    EXPECT_EQ(measured.photographs[i].reason, reasons[i]);
    EXPECT_EQ(measured.photographs[i].features.empty(), !reasons[i].empty());
  }
}

}  // namespace
}  // namespace hexcal
