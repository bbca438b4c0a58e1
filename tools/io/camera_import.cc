#include <fmt/format.h>

#include <cmath>

#include "camera_calib/fit_lens_model.h"
#include "kinematics/geometry/input_error.h"
#include "tools/io/atomic_file.h"
#include "tools/io/camera_export.h"
#include "tools/io/yaml_map.h"

namespace hexcal {
namespace {

constexpr int kSmallestEdgePx = 16;
constexpr int kLargestEdgePx = 65535;

CameraModel from_opencv_values(const YamlMap& map, int width, int height, const std::vector<double>& matrix,
                               const std::vector<double>& terms) {
  const bool brown = terms.size() <= 5;
  if (terms.size() != 4 && terms.size() != 5 && terms.size() != 8 && terms.size() != 12) {
    map.fail("distortion_coefficients",
             fmt::format("found {} coefficients, wanted 4, 5, 8 or 12", terms.size()));
  }
  CameraModel camera(width, height, matrix[4], brown ? LensModel::brown : LensModel::rational);
  camera.parameters[1] = matrix[0] / matrix[4] - 1;
  camera.parameters[2] = matrix[2];
  camera.parameters[3] = matrix[5];
  for (std::size_t i = 0; i < terms.size(); ++i) {
    camera.parameters[static_cast<Eigen::Index>(i) + CameraModel::kNumPinhole] = terms[i];
  }
  return camera;
}

void check_edge(const YamlMap& map, const std::string& key, double edge) {
  if (edge == std::floor(edge) && edge >= kSmallestEdgePx && edge <= kLargestEdgePx) return;
  map.fail(key, fmt::format("found {}, wanted a whole number from {} to {}", edge, kSmallestEdgePx,
                            kLargestEdgePx));
}

// OpenCV writes a header that is not YAML 1.2 and several files of samples use capitalised names.
std::string without_opencv_header(std::string text) {
  if (text.starts_with("%YAML:1.0")) text = text.substr(text.find('\n') + 1);
  return text;
}

ForeignCamera read_opencv(const YamlMap& map) {
  const auto key = [&map](const char* first, const char* second) { return map.has(first) ? first : second; };
  const YamlMap matrix = map.map(key("camera_matrix", "Camera_Matrix"));
  const YamlMap terms = map.map(key("distortion_coefficients", "Distortion_Coefficients"));
  for (const char* edge : {"image_width", "image_height"}) check_edge(map, edge, map.number(edge));
  ForeignCamera out;
  out.camera.model = from_opencv_values(map, map.integer("image_width"), map.integer("image_height"),
                                        matrix.numbers("data", 9), terms.numbers("data"));
  out.format = map.has("distortion_model") ? "ros" : "opencv";
  if (map.has("distortion_model")) {
    (void)map.choice("distortion_model", {"plumb_bob", "rational_polynomial"});
  }
  return out;
}

// Measured to corrected, mm from the principal point, y up (PhotoModeler's "lens distortion formulation").
ForeignCamera read_photomodeler(const YamlMap& map) {
  const YamlMap values = map.map("photomodeler");
  const double focal = values.number("focal_mm");
  const std::vector<double> principal = values.numbers("principal_point_mm", 2);
  const std::vector<double> format = values.numbers("format_mm", 2);
  const std::vector<double> k = values.numbers("k", 3);
  const std::vector<double> p = values.numbers("p", 2);
  values.finish();
  const std::vector<double> size = map.numbers("image_size_px", 2);
  map.finish();
  if (!(focal > 0) || !(format[0] > 0) || !(format[1] > 0)) {
    map.fail("photomodeler", "wanted positive focal_mm and format_mm");
  }
  for (const double edge : size) check_edge(map, "image_size_px", edge);
  const int width = static_cast<int>(size[0]);
  const int height = static_cast<int>(size[1]);
  std::vector<RayPixel> rays;
  constexpr int kColumns = 40;
  constexpr int kRows = 30;
  for (int j = 0; j < kRows; ++j) {
    for (int i = 0; i < kColumns; ++i) {
      const Eigen::Vector2d px(i * (width - 1.0) / (kColumns - 1), j * (height - 1.0) / (kRows - 1));
      // Its first pixel's centre is at (0.5, 0.5).
      const double x = (px.x() + 0.5) * format[0] / width - principal[0];
      const double y = principal[1] - (px.y() + 0.5) * format[1] / height;
      const double r2 = x * x + y * y;
      const double radial = r2 * (k[0] + r2 * (k[1] + r2 * k[2]));
      const double xc = x + x * radial + p[0] * (r2 + 2 * x * x) + 2 * p[1] * x * y;
      const double yc = y + y * radial + p[1] * (r2 + 2 * y * y) + 2 * p[0] * x * y;
      const double moved = std::hypot(xc - x, yc - y);
      if (!(moved < 0.5 * std::hypot(format[0], format[1]))) {
        map.fail("photomodeler",
                 fmt::format("k and p move a point of the frame by {:.3g} mm, wanted less than half "
                             "its diagonal",
                             moved));
      }
      rays.push_back({{xc / focal, -yc / focal}, px});
    }
  }
  const LensModelFit fit = fit_lens_model(rays, width, height, LensModel::brown);
  constexpr double kLargestRmsPx = 1;
  if (!fit.converged || !(fit.rms_px < kLargestRmsPx)) {
    map.fail("photomodeler",
             fmt::format("no Brown camera has these values (the best differs by {:.3g} px rms)", fit.rms_px));
  }
  ForeignCamera out;
  out.camera.model = fit.camera;
  out.format = "photomodeler";
  out.fit_rms_px = fit.rms_px;
  return out;
}

}  // namespace

ForeignCamera read_foreign_camera(const std::filesystem::path& path) {
  const YamlMap map = YamlMap::parse(without_opencv_header(read_file(path)), path);
  ForeignCamera out = map.has("photomodeler") ? read_photomodeler(map) : read_opencv(map);
  CameraModel& camera = out.camera.model;
  if (!(camera.fx_px() > 0) || !(camera.fy_px() > 0) || !camera.parameters.allFinite()) {
    throw InputError(
        fmt::format("{}: wanted a positive focal length and numbers of a camera", path.string()));
  }
  out.camera.setting.width_px = camera.width_px;
  out.camera.setting.height_px = camera.height_px;
  return out;
}

}  // namespace hexcal
