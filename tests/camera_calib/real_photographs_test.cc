// Public photographs by others, where they are: each test is skipped without them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "camera_calib/measure_camera.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

const fs::path kShared = fs::path(HEXCAL_SOURCE) / "../shared/data";

std::vector<fs::path> photographs_in(const fs::path& folder, const std::string& start = "") {
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string extension = entry.path().extension();
    const bool is_image = extension == ".png" || extension == ".jpg" || extension == ".JPG";
    if (is_image && entry.path().filename().string().starts_with(start)) paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

Sheet chessboard(int columns, int rows, double square_mm) {
  Sheet sheet;
  sheet.kind = SheetKind::chessboard;
  sheet.columns = columns;
  sheet.rows = rows;
  sheet.pitch_mm = square_mm;
  return sheet;
}

struct Found {
  MeasuredCamera measured;
  CameraModel camera;
  double sigma_f, sigma_cx, sigma_cy;
  double rms_px;  // of the distance of a point
  std::size_t photographs;
};

Found calibrate(const std::vector<fs::path>& paths, const Sheet& sheet) {
  Found found{measure_camera(paths, {sheet}), {}, 0, 0, 0, 0, 0};
  const SheetAdjustmentResult& fit = found.measured.calibration.fit.adjustment;
  found.camera = fit.state.camera;
  found.sigma_f = std::sqrt(fit.camera_covariance(0, 0));
  found.sigma_cx = std::sqrt(fit.camera_covariance(2, 2));
  found.sigma_cy = std::sqrt(fit.camera_covariance(3, 3));
  found.rms_px = fit.rms_px();
  found.photographs = fit.state.views.size();
  return found;
}

// github.com/xoox/calibrel_testdata, dataset1 (BSD-3): a laser print on glass, calipers across its outer
// corners. calibrel's own answer with released points: rms 0.0866 px, f 3041.1 px, p1p4 261.90, p2p3 262.10,
// p3p4 224.725 mm.
TEST(RealPhotographs, CalibrelsBoardMeasuresAsCalipersSay) {
  const fs::path folder = kShared / "calibrel/dataset1";
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not there";
  const Sheet sheet = chessboard(17, 11, 15.0);
  const Found found = calibrate(photographs_in(folder), sheet);
  ASSERT_EQ(found.measured.calibration.status, CalibrationStatus::ok);
  EXPECT_EQ(found.photographs, 20U);
  EXPECT_LE(found.rms_px, 0.087);
  EXPECT_NEAR(found.camera.fx_px(), 3041.0, 2.0);
  EXPECT_EQ(found.measured.calibration.variant.board, BoardFreedom::points);
  const std::vector<Eigen::Vector3d> points =
      shaped_points(sheet, found.measured.calibration.fit.adjustment.state.shapes[0]);
  ASSERT_EQ(points.size(), 160U);
  // The board was photographed either way up; its longer edge tells p3 p4 from p1 p2.
  std::array<std::size_t, 4> p{0, 15, 144, 159};
  const auto distance = [&](std::size_t a, std::size_t b) { return (points[p[a]] - points[p[b]]).norm(); };
  if (distance(0, 1) > distance(2, 3)) p = {159, 144, 15, 0};
  const double scale = 224.14 / distance(0, 1);
  EXPECT_NEAR(scale * distance(2, 3), 224.73, 0.20);
  EXPECT_NEAR(scale * distance(0, 2), 135.35, 0.20);
  EXPECT_NEAR(scale * distance(1, 3), 135.13, 0.20);
  EXPECT_NEAR(scale * distance(0, 3), 261.85, 0.20);
  EXPECT_NEAR(scale * distance(1, 2), 262.00, 0.20);
}

// PhotoModeler's marks of each photograph, px, in its pixel convention turned to ours.
std::map<int, std::vector<Eigen::Vector2d>> photomodeler_marks(const fs::path& file) {
  std::map<int, std::vector<Eigen::Vector2d>> marks;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::istringstream fields(line);
    int id = 0;
    int photograph = 0;
    double x = 0;
    double y = 0;
    char comma = 0;
    if (!(fields >> id >> comma >> photograph >> comma >> x >> comma >> y)) continue;
    marks[photograph].emplace_back(x - 0.5, y - 0.5);
  }
  return marks;
}

// The PhotoModeler sheet of DBAT's camcal example (github.com/niclasborlin/dbat) with PhotoModeler's own
// marks and solution: f 7.4653 mm, principal point 3.6173, 2.6128 mm on a sensor of 7.25319 x 5.43764 mm. The
// dots are 0.223 of their spacing wide.
TEST(RealPhotographs, DbatsPhotoModelerSheet) {
  const fs::path folder = kShared / "dbat_camcal";
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not there";
  Sheet sheet;
  sheet.kind = SheetKind::photomodeler;
  sheet.columns = sheet.rows = 10;
  sheet.pitch_mm = 100;
  sheet.dot_mm = 22.3;
  const Found found = calibrate(photographs_in(folder / "images"), sheet);
  ASSERT_EQ(found.measured.calibration.status, CalibrationStatus::ok);
  EXPECT_EQ(found.photographs, 21U);
  EXPECT_LE(found.rms_px, 0.23);
  const double px_per_mm = 2272 / 7.25319;
  EXPECT_NEAR(found.camera.fx_px(), 7.4653 * px_per_mm, 3 * found.sigma_f);
  EXPECT_NEAR(found.camera.cx_px(), 3.6173 * px_per_mm - 0.5, 3 * found.sigma_cx);
  EXPECT_NEAR(found.camera.cy_px(), 2.6128 * px_per_mm - 0.5, 3 * found.sigma_cy);
  const auto marks = photomodeler_marks(folder / "pmexports/fixed-no-orient-2dpts.txt");
  double sum = 0;
  int compared = 0;
  for (const SheetView& view : found.measured.calibration.fit.adjustment.state.views) {
    for (std::size_t f = 0; f < view.features.size(); ++f) {
      if (view.rejected[f] != 0) continue;
      double nearest = 3;  // px; PhotoModeler did not mark every dot
      for (const Eigen::Vector2d& mark : marks.at(view.photograph + 1)) {
        nearest = std::min(nearest, (view.features[f].px - mark).norm());
      }
      if (nearest >= 3) continue;
      sum += nearest * nearest;
      ++compared;
    }
  }
  EXPECT_GT(compared, 1900);
  // Per coordinate. PhotoModeler marks the ellipses' centres, ours are the dots' (up to 0.15 px apart here).
  EXPECT_LE(std::sqrt(sum / (2 * compared)), 0.20);
}

// OpenCV's published answer for these is f 535.9 px (opencv-doc, calib3d tutorial).
TEST(RealPhotographs, OpenCvsChessboard) {
  const fs::path folder = "/usr/share/doc/opencv-doc/examples/data";
  if (!fs::exists(folder / "left01.jpg")) GTEST_SKIP() << folder << " holds no left01.jpg: opencv-doc";
  const Found found = calibrate(photographs_in(folder, "left"), chessboard(10, 7, 25.0));
  ASSERT_EQ(found.measured.calibration.status, CalibrationStatus::ok);
  EXPECT_GE(found.photographs, 13U);
  EXPECT_LE(found.rms_px, 0.41);
  EXPECT_NEAR(found.camera.fx_px(), 535.9, 3 * found.sigma_f);
}

}  // namespace
}  // namespace hexcal
