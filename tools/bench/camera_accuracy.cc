// Accuracy of camera calibration on rendered sets with known truth, beside OpenCV and mrcal on the same
// corners.
//
//   camera_accuracy SET...         each holds calibration/, sheet.yaml and truth/camera.yaml (hexcal
//   simulate) camera_accuracy --monte-carlo  60 synthetic calibrations: true errors over predicted sigmas
//
// Printed: difference of projection to truth over the whole frame, best rotation taken out, px, and its size
// over the predicted sigma at centre, edge and corner. mrcal runs through mrcal_camera.py (Debian's
// python3-mrcal).

#include <fmt/format.h>
#include <unistd.h>

#include <Eigen/LU>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>

#include "camera_calib/camera_report.h"
#include "camera_calib/measure_camera.h"
#include "camera_calib/projection_difference.h"
#include "tests/support/synthetic_sheets.h"
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

// What mrcal's best model gives, if its Python package is there.
std::optional<double> calibrate_with_mrcal(const std::vector<Sheet>& sheets, const SheetAdjustmentResult& fit,
                                           const CameraModel& truth) {
  if (sheets.size() != 1) return std::nullopt;
  const fs::path folder = fs::temp_directory_path() / fmt::format("camera_accuracy_{}", ::getpid());
  fs::create_directories(folder);
  const auto drawn = sheet_points(sheet_geometry(sheets[0]));
  const CameraModel& ours = fit.state.camera;
  std::ofstream(folder / "camera.csv") << fmt::format("{},{},{},{},{}\n", ours.width_px, ours.height_px,
                                                      ours.fy_px(), ours.cx_px(), ours.cy_px());
  std::ofstream points(folder / "points.csv");
  std::ofstream views(folder / "views.csv");
  for (std::size_t v = 0; v < fit.state.views.size(); ++v) {
    const SheetView& view = fit.state.views[v];
    const Eigen::Vector3d w = rotation_vector_from_quaternion(view.camera_from_sheet.rotation);
    const Eigen::Vector3d& t = view.camera_from_sheet.translation;
    views << fmt::format("{},{},{},{},{},{}\n", w.x(), w.y(), w.z(), t.x(), t.y(), t.z());
    for (std::size_t f = 0; f < view.features.size(); ++f) {
      if (view.rejected[f] != 0) continue;
      for (int i = 0; i < view.features[f].points(); ++i) {
        const auto& p = drawn[static_cast<std::size_t>(view.features[f].first_point + i)].position_mm;
        points << fmt::format("{},{},{},{},{},{}\n", v, p.x(), p.y(), p.z(), view.features[f].px[2 * i],
                              view.features[f].px[2 * i + 1]);
      }
    }
  }
  std::ofstream rays(folder / "rays.csv");
  for (const Eigen::Vector2d& px : projection_difference(truth, truth).px) {
    if (const auto n = truth.normalised_from_image(px)) {
      rays << fmt::format("{},{},{},{},1\n", px.x(), px.y(), n->x(), n->y());
    }
  }
  for (std::ofstream* file : {&points, &views, &rays}) file->close();
  const std::string command =
      fmt::format("/usr/bin/python3 {}/mrcal_camera.py {} 2>/dev/null", HEXCAL_BENCH_SOURCE, folder.string());
  std::optional<double> rms;
  if (std::FILE* pipe = ::popen(command.c_str(), "r")) {
    double value = 0;
    if (std::fscanf(pipe, "%lf", &value) == 1) rms = value;
    ::pclose(pipe);
  }
  fs::remove_all(folder);
  return rms;
}

// Error over sigma at the cells where a judge would look; root mean square of the two axes.
struct Normalised {
  double centre = 0, edge = 0, corner = 0;
};

double normalised_at(const ProjectionDifference& error, const ProjectionUncertainty& sigma, int column,
                     int row) {
  const auto at = static_cast<std::size_t>(row * error.columns + column);
  const Eigen::Vector2d e = error.difference_px[at];
  return std::sqrt(e.dot(sigma.covariance_px2[at].inverse() * e) / 2);
}

Normalised normalised(const ProjectionDifference& error, const ProjectionUncertainty& sigma) {
  const int right = error.columns - 1;
  const int bottom = error.rows - 1;
  return {normalised_at(error, sigma, error.columns / 2, error.rows / 2),
          normalised_at(error, sigma, right, error.rows / 2), normalised_at(error, sigma, right, bottom)};
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
  const std::optional<double> mrcal = calibrate_with_mrcal(sheets, fit, truth);
  const ProjectionDifference from_ours = projection_difference(fit.state.camera, truth);
  const Normalised n = normalised(from_ours, report.uncertainty);
  fmt::print(
      "{:<12} hexcal {:.4f} rms {:.4f} max   best model of OpenCV {:.4f}, of mrcal {}   sigma centre {:.4f} "
      "corner "
      "{:.4f}   error over sigma: centre {:.2f} edge {:.2f} corner {:.2f}   rms {:.4f}   {} photographs {} "
      "points   "
      "{:.1f} s = {:.1f} x imread\n",
      set.filename().string(), ours.rms_px, ours.max_px, opencv, mrcal ? fmt::format("{:.4f}", *mrcal) : "?",
      report.quality.uncertainty_centre_px, report.quality.uncertainty_corner_px, n.centre, n.edge, n.corner,
      report.quality.rms_px, report.quality.photographs, report.quality.points, whole_s, whole_s / read_s);
}

void monte_carlo() {
  constexpr int kRuns = 60;
  const std::vector<Sheet> sheets{synthetic_aprilgrid()};
  for (const double focal_mm : {35.0, 105.0}) {
    SyntheticSheets synthetic;
    synthetic.camera = profile_camera(focal_mm);
    synthetic.sigma_px = 0.01;
    double sums[3] = {0, 0, 0};
    double rms = 0;
    for (int run = 0; run < kRuns; ++run) {
      synthetic.seed = static_cast<unsigned>(100 + run);
      const auto photographs = synthetic_photographs(sheets[0], synthetic);
      const CameraCalibration rough = rough_calibration(sheets, photographs);
      const CameraCalibration calibration =
          calibrate_camera(sheets, rough.fit.adjustment.state, rough.fit.extra_sigma_px);
      const CameraReport report = report_calibration(sheets, photographs, calibration);
      const ProjectionDifference error =
          projection_difference(calibration.fit.adjustment.state.camera, synthetic.camera);
      const Normalised n = normalised(error, report.uncertainty);
      sums[0] += n.centre * n.centre;
      sums[1] += n.edge * n.edge;
      sums[2] += n.corner * n.corner;
      rms += error.rms_px * error.rms_px;
    }
    fmt::print(
        "{} mm, {} calibrations, models chosen each time: error over sigma rms centre {:.2f} edge {:.2f} "
        "corner {:.2f}; projection error rms {:.4f} px\n",
        focal_mm, kRuns, std::sqrt(sums[0] / kRuns), std::sqrt(sums[1] / kRuns), std::sqrt(sums[2] / kRuns),
        std::sqrt(rms / kRuns));
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "camera_accuracy: wanted folders that hexcal simulate made\n");
    return 2;
  }
  for (int i = 1; i < argc; ++i) {
    if (std::string_view(argv[i]) == "--monte-carlo") {
      monte_carlo();
    } else {
      measure_set(argv[i]);
    }
  }
  return 0;
}
