#include "tools/io/camera_export.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "camera_calib/fit_lens_model.h"
#include "kinematics/geometry/input_error.h"
#include "tools/io/atomic_file.h"
#include "tools/io/version.h"

namespace hexcal {
namespace {

std::string list(const std::vector<double>& values) { return fmt::format("[{}]", fmt::join(values, ", ")); }

std::vector<double> lens_terms(const CameraModel& camera, std::size_t count) {
  std::vector<double> out(count, 0.0);
  for (std::size_t i = 0; i < count; ++i) {
    const auto at = static_cast<Eigen::Index>(i) + CameraModel::kNumPinhole;
    if (at < camera.parameters.size()) out[i] = camera.parameters[at];
  }
  return out;
}

std::vector<double> matrix(const CameraModel& c) {
  return {c.fx_px(), 0, c.cx_px(), 0, c.fy_px(), c.cy_px(), 0, 0, 1};
}

// The camera in OpenCV's parametrisation with at most `terms` of its coefficients.
LensModelFit as_opencv(const CameraModel& camera, std::size_t terms) {
  const bool brown = camera.lens == LensModel::brown;
  const bool fits = (brown && (terms >= 5 || camera.parameters[8] == 0)) ||
                    (camera.lens == LensModel::rational && terms >= 12);
  if (fits) return {true, camera, 0, 0};
  std::vector<std::string> held;
  if (terms < 12) held = {"s1", "s2", "s3", "s4"};
  if (terms < 5) held = {"k3"};
  const LensModel lens = terms > 5 ? LensModel::rational : LensModel::brown;
  return fit_lens_model(frame_rays(camera), camera.width_px, camera.height_px, lens, held);
}

// By which a later export knows that it may write over the file.
std::string mark() { return provenance_line(kVersion, "export", {}); }

std::size_t opencv_terms(const CameraModel& camera, std::size_t most) {
  return camera.lens == LensModel::brown ? std::min<std::size_t>(5, most) : most;
}

std::string opencv_matrix(const char* name, int rows, int columns, const std::vector<double>& data) {
  return fmt::format("{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: {}\n", name, rows,
                     columns, list(data));
}

CameraExport to_opencv(const CameraModel& source) {
  const std::size_t terms = opencv_terms(source, 12);
  const LensModelFit fit = as_opencv(source, terms);
  const CameraModel& c = fit.camera;
  std::string text =
      fmt::format("%YAML:1.0\n---\n{}image_width: {}\nimage_height: {}\n", mark(), c.width_px, c.height_px);
  text += opencv_matrix("camera_matrix", 3, 3, matrix(c));
  text += opencv_matrix("distortion_coefficients", static_cast<int>(terms), 1, lens_terms(c, terms));
  return {text, terms == 5 ? "OpenCV 5 coefficients" : "OpenCV 12 coefficients", fit.rms_px, fit.max_px};
}

std::string ros_matrix(const char* name, int rows, int columns, const std::vector<double>& data) {
  return fmt::format("{}:\n  rows: {}\n  cols: {}\n  data: {}\n", name, rows, columns, list(data));
}

CameraExport to_ros(const CameraModel& source) {
  const std::size_t terms = opencv_terms(source, 8);
  const LensModelFit fit = as_opencv(source, terms);
  const CameraModel& c = fit.camera;
  const std::string model = terms == 5 ? "plumb_bob" : "rational_polynomial";
  std::string text = fmt::format("{}image_width: {}\nimage_height: {}\ncamera_name: hexcal\n", mark(),
                                 c.width_px, c.height_px);
  text += ros_matrix("camera_matrix", 3, 3, matrix(c));
  text += fmt::format("distortion_model: {}\n", model);
  text += ros_matrix("distortion_coefficients", 1, static_cast<int>(terms), lens_terms(c, terms));
  text += ros_matrix("rectification_matrix", 3, 3, {1, 0, 0, 0, 1, 0, 0, 0, 1});
  text += ros_matrix("projection_matrix", 3, 4,
                     {c.fx_px(), 0, c.cx_px(), 0, 0, c.fy_px(), c.cy_px(), 0, 0, 0, 1, 0});
  return {text, model, fit.rms_px, fit.max_px};
}

CameraExport to_kalibr(const CameraModel& source) {
  const LensModelFit fit = as_opencv(source, 4);
  const CameraModel& c = fit.camera;
  const std::string text = fmt::format(
      "{}cam0:\n  camera_model: pinhole\n  intrinsics: {}\n  distortion_model: radtan\n  distortion_coeffs: "
      "{}\n"
      "  resolution: [{}, {}]\n  rostopic: /cam0/image_raw\n",
      mark(), list({c.fx_px(), c.fy_px(), c.cx_px(), c.cy_px()}), list(lens_terms(c, 4)), c.width_px,
      c.height_px);
  return {text, "pinhole-radtan", fit.rms_px, fit.max_px};
}

CameraExport to_colmap(const CameraModel& source) {
  const LensModelFit fit = as_opencv(source, 8);
  const CameraModel& c = fit.camera;
  // COLMAP's pixel (0, 0) is the corner of the top-left pixel.
  std::vector<double> values{c.fx_px(), c.fy_px(), c.cx_px() + 0.5, c.cy_px() + 0.5};
  const std::vector<double> terms = lens_terms(c, 8);
  values.insert(values.end(), terms.begin(), terms.end());
  const std::string text =
      fmt::format("# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n1 FULL_OPENCV {} {} {}\n", c.width_px,
                  c.height_px, fmt::join(values, " "));
  return {text, "FULL_OPENCV", fit.rms_px, fit.max_px};
}

CameraExport to_mrcal(const CameraModel& source) {
  const std::size_t terms = opencv_terms(source, 12);
  const LensModelFit fit = as_opencv(source, terms);
  const CameraModel& c = fit.camera;
  std::vector<double> values{c.fx_px(), c.fy_px(), c.cx_px(), c.cy_px()};
  const std::vector<double> lens = lens_terms(c, terms);
  values.insert(values.end(), lens.begin(), lens.end());
  const std::string model = fmt::format("LENSMODEL_OPENCV{}", terms);
  const std::string text = fmt::format(
      "{{\n    'lensmodel':  '{}',\n    'extrinsics': [ 0, 0, 0, 0, 0, 0 ],\n    'intrinsics': {},\n"
      "    'imagersize': [ {}, {} ]\n}}\n",
      model, list(values), c.width_px, c.height_px);
  return {text, model, fit.rms_px, fit.max_px};
}

}  // namespace

const std::vector<std::string>& camera_export_formats() {
  static const std::vector<std::string> names{"opencv", "ros", "kalibr", "colmap", "mrcal"};
  return names;
}

CameraExport export_camera(const CalibratedCamera& camera, const std::string& format) {
  if (format == "opencv") return to_opencv(camera.model);
  if (format == "ros") return to_ros(camera.model);
  if (format == "kalibr") return to_kalibr(camera.model);
  if (format == "colmap") return to_colmap(camera.model);
  if (format == "mrcal") return to_mrcal(camera.model);
  throw InputError(fmt::format("--to: found '{}', wanted one of {} for a camera", format,
                               fmt::join(camera_export_formats(), ", ")));
}

}  // namespace hexcal
