// Accuracy of camera calibration on rendered sets with known truth, beside OpenCV on the same corners.
//
//   camera_accuracy SET...     each holds calibration/, sheet.yaml and truth/camera.yaml (hexcal simulate)
//
// Printed: difference of projection to truth over the whole frame, best rotation taken out, px.

#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>

#include "camera_calib/camera_report.h"
#include "camera_calib/measure_camera.h"
#include "camera_calib/projection_difference.h"
#include "tools/io/camera_file.h"
#include "tools/io/sheet_file.h"

namespace {

using namespace hexcal;
namespace fs = std::filesystem;

// OpenCV's calibration of the features that ours used; no weights, no outlier test, ideal sheet.
CameraModel calibrate_with_opencv(const std::vector<Sheet>& sheets, const SheetAdjustmentResult& fit,
                                  int flags) {
  std::vector<std::vector<cv::Point3f>> object;
  std::vector<std::vector<cv::Point2f>> image;
  for (const SheetView& view : fit.state.views) {
    const auto points = sheet_points(sheet_geometry(sheets[static_cast<std::size_t>(view.sheet)]));
    object.emplace_back();
    image.emplace_back();
    for (std::size_t f = 0; f < view.features.size(); ++f) {
      if (view.rejected[f] != 0) continue;
      const FeatureObservation& feature = view.features[f];
      for (int i = 0; i < feature.points(); ++i) {
        const Eigen::Vector3d& p = points[static_cast<std::size_t>(feature.first_point + i)].position_mm;
        object.back().emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()), 0.0F);
        image.back().emplace_back(static_cast<float>(feature.px[2 * i]),
                                  static_cast<float>(feature.px[2 * i + 1]));
      }
    }
  }
  const CameraModel& ours = fit.state.camera;
  cv::Mat matrix =
      (cv::Mat_<double>(3, 3) << ours.fx_px(), 0, ours.cx_px(), 0, ours.fy_px(), ours.cy_px(), 0, 0, 1);
  cv::Mat terms;
  std::vector<cv::Mat> rotations;
  std::vector<cv::Mat> translations;
  cv::calibrateCamera(object, image, {ours.width_px, ours.height_px}, matrix, terms, rotations, translations,
                      flags | cv::CALIB_USE_INTRINSIC_GUESS,
                      cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 100, 1e-12));
  CameraModel out(ours.width_px, ours.height_px, matrix.at<double>(1, 1), LensModel::rational);
  out.parameters[1] = matrix.at<double>(0, 0) / matrix.at<double>(1, 1) - 1;
  out.parameters[2] = matrix.at<double>(0, 2);
  out.parameters[3] = matrix.at<double>(1, 2);
  for (int i = 0; i < std::min(12, static_cast<int>(terms.total())); ++i) {
    out.parameters[CameraModel::kNumPinhole + i] = terms.at<double>(i);
  }
  return out;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void measure_set(const fs::path& set) {
  const std::vector<Sheet> sheets = read_sheet_file(set / "sheet.yaml");
  const CameraModel truth = read_camera_file(set / "truth" / "camera.yaml").model;
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(set / "calibration")) paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  auto start = std::chrono::steady_clock::now();
  for (const fs::path& path : paths) (void)cv::imread(path.string());
  const double read_s = seconds_since(start);
  start = std::chrono::steady_clock::now();
  const MeasuredCamera measured = measure_camera(paths, sheets);
  const CameraReport report = report_calibration(sheets, measured.photographs, measured.calibration);
  const double whole_s = seconds_since(start);
  if (measured.calibration.status != CalibrationStatus::ok) {
    fmt::print("{:<24} failed: {}\n", set.filename().string(), measured.calibration.reason);
    return;
  }
  const SheetAdjustmentResult& fit = measured.calibration.fit.adjustment;
  const ProjectionDifference ours = projection_difference(truth, fit.state.camera);
  double opencv = 1e9;
  for (const int flags : {0, static_cast<int>(cv::CALIB_RATIONAL_MODEL),
                          static_cast<int>(cv::CALIB_RATIONAL_MODEL | cv::CALIB_THIN_PRISM_MODEL)}) {
    opencv = std::min(opencv, projection_difference(truth, calibrate_with_opencv(sheets, fit, flags)).rms_px);
  }
  fmt::print(
      "{:<24} hexcal {:.4f} rms {:.4f} max   OpenCV's best model {:.4f}   predicted sigma centre {:.4f} "
      "corner "
      "{:.4f}   rms {:.4f}   {} photographs {} points   {:.1f} s = {:.1f} x imread\n",
      set.filename().string(), ours.rms_px, ours.max_px, opencv, report.quality.uncertainty_centre_px,
      report.quality.uncertainty_corner_px, report.quality.rms_px, report.quality.photographs,
      report.quality.points, whole_s, whole_s / read_s);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "camera_accuracy: wanted folders that hexcal simulate made\n");
    return 2;
  }
  for (int i = 1; i < argc; ++i) measure_set(argv[i]);
  return 0;
}
