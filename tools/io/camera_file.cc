#include "tools/io/camera_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "kinematics/geometry/input_error.h"
#include "tools/io/yaml_map.h"

namespace hexcal {
namespace {

CameraModel read_model(const YamlMap& map) {
  const LensModel lens = *lens_model_from_name(map.choice("model", {"brown", "rational", "radial"}));
  const std::vector<double> size = map.numbers("image_size_px", 2);
  for (const double edge : size) {
    if (edge != std::floor(edge) || edge < 16 || edge > 65535) {
      map.fail("image_size_px", fmt::format("found {}, wanted whole numbers from 16 to 65535", edge));
    }
  }
  CameraModel model(static_cast<int>(size[0]), static_cast<int>(size[1]), 1.0, lens);
  const YamlMap parameters = map.map("parameters");
  Eigen::Index i = 0;
  for (const std::string& name : camera_parameter_names(lens))
    model.parameters[i++] = parameters.number(name);
  parameters.finish();
  if (!(model.fy_px() > 0) || !(model.fx_px() > 0)) {
    parameters.fail("f_px", fmt::format("found {}, wanted a positive focal length", model.fy_px()));
  }
  if (!model.contains({model.cx_px(), model.cy_px()})) {
    parameters.fail("cx_px", fmt::format("the principal point ({}, {}) lies outside the {} x {} px frame",
                                         model.cx_px(), model.cy_px(), model.width_px, model.height_px));
  }
  if (map.has("valid_radius")) {
    model.valid_radius = map.number("valid_radius");
    if (!(model.valid_radius > 0)) map.fail("valid_radius", "wanted more than 0");
  }
  return model;
}

void check_invertible(const YamlMap& map, const CameraModel& model) {
  for (const double x : {0.0, 0.5 * (model.width_px - 1), model.width_px - 1.0}) {
    for (const double y : {0.0, 0.5 * (model.height_px - 1), model.height_px - 1.0}) {
      if (!model.normalised_from_image({x, y})) {
        map.fail("parameters",
                 fmt::format("the lens model has no inverse at pixel ({:g}, {:g}) of its own frame", x, y));
      }
    }
  }
}

Eigen::MatrixXd read_covariance(const YamlMap& map, LensModel lens) {
  if (!map.has("covariance")) return {};
  const YamlMap rows = map.map("covariance");
  const std::vector<std::string>& names = camera_parameter_names(lens);
  const auto count = static_cast<Eigen::Index>(names.size());
  Eigen::MatrixXd covariance(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::vector<double> row = rows.numbers(names[static_cast<std::size_t>(i)], names.size());
    covariance.row(i) = Eigen::Map<const Eigen::RowVectorXd>(row.data(), count);
  }
  rows.finish();
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  for (Eigen::Index i = 0; i < count; ++i) {
    if (covariance(i, i) < 0) {
      rows.fail(names[static_cast<std::size_t>(i)], fmt::format("variance {} is negative", covariance(i, i)));
    }
    for (Eigen::Index j = 0; j < i; ++j) {
      const double tolerance = 1e-9 * sigma[i] * sigma[j];
      if (std::abs(covariance(i, j) - covariance(j, i)) > tolerance ||
          std::abs(covariance(i, j)) > sigma[i] * sigma[j] * (1 + 1e-9)) {
        rows.fail(names[static_cast<std::size_t>(i)],
                  fmt::format("covariance with {} is not that of a symmetric, positive matrix",
                              names[static_cast<std::size_t>(j)]));
      }
    }
  }
  return covariance;
}

LensSetting read_setting(const YamlMap& map, const CameraModel& model) {
  LensSetting setting;
  setting.width_px = model.width_px;
  setting.height_px = model.height_px;
  if (!map.has("setting")) return setting;
  const YamlMap s = map.map("setting");
  const auto number = [&s](const char* key) {
    return s.has(key) ? std::optional<double>(s.number(key)) : std::nullopt;
  };
  const auto integer = [&s](const char* key) {
    return s.has(key) ? std::optional<int>(s.integer(key)) : std::nullopt;
  };
  setting.make = s.optional_text("make");
  setting.model = s.optional_text("model");
  setting.serial = s.optional_text("serial");
  setting.lens = s.optional_text("lens");
  setting.lens_id = integer("lens_id");
  setting.focal_length_mm = number("focal_length_mm");
  setting.focus_distance_code = integer("focus_distance_code");
  setting.f_number = number("f_number");
  if (s.has("vibration_reduction")) setting.vibration_reduction = s.boolean_or("vibration_reduction", false);
  s.finish();
  return setting;
}

CameraQuality read_quality(const YamlMap& map) {
  CameraQuality quality;
  if (!map.has("quality")) return quality;
  const YamlMap q = map.map("quality");
  const std::string verdict = q.choice("verdict", {"unknown", "good", "usable", "retake"});
  for (const CameraVerdict v : {CameraVerdict::good, CameraVerdict::usable, CameraVerdict::retake}) {
    if (verdict == camera_verdict_name(v)) quality.verdict = v;
  }
  quality.rms_px = q.number("rms_px");
  quality.sigma0 = q.number("sigma0");
  quality.photographs = q.integer("photographs");
  quality.points = q.integer("points");
  quality.uncertainty_centre_px = q.number("uncertainty_centre_px");
  quality.uncertainty_corner_px = q.number("uncertainty_corner_px");
  quality.cross_validation_px = q.number("cross_validation_px");
  quality.coverage_percent = q.number("coverage_percent");
  q.finish();
  return quality;
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out + '"';
}

std::string format_setting(const LensSetting& setting) {
  std::string out;
  const auto add = [&out](const char* key, const std::string& value) {
    out += fmt::format("  {}: {}\n", key, value);
  };
  if (setting.make) add("make", quoted(*setting.make));
  if (setting.model) add("model", quoted(*setting.model));
  if (setting.serial) add("serial", quoted(*setting.serial));
  if (setting.lens) add("lens", quoted(*setting.lens));
  if (setting.lens_id) add("lens_id", fmt::format("{}", *setting.lens_id));
  if (setting.focal_length_mm) add("focal_length_mm", fmt::format("{}", *setting.focal_length_mm));
  if (setting.focus_distance_code)
    add("focus_distance_code", fmt::format("{}", *setting.focus_distance_code));
  if (setting.f_number) add("f_number", fmt::format("{}", *setting.f_number));
  if (setting.vibration_reduction)
    add("vibration_reduction", *setting.vibration_reduction ? "true" : "false");
  return out.empty() ? out : "setting:\n" + out;
}

std::string format_quality(const CameraQuality& q) {
  if (q.verdict == CameraVerdict::unknown && q.photographs == 0) return "";
  return fmt::format(
      "quality:\n  verdict: {}\n  rms_px: {:.4f}\n  sigma0: {:.4f}\n  photographs: {}\n  points: {}\n"
      "  uncertainty_centre_px: {:.5f}\n  uncertainty_corner_px: {:.5f}\n  cross_validation_px: {:.5f}\n"
      "  coverage_percent: {:.1f}\n",
      camera_verdict_name(q.verdict), q.rms_px, q.sigma0, q.photographs, q.points, q.uncertainty_centre_px,
      q.uncertainty_corner_px, q.cross_validation_px, q.coverage_percent);
}

}  // namespace

CalibratedCamera read_camera_file(const std::filesystem::path& path) {
  const YamlMap map = YamlMap::read(path);
  CalibratedCamera camera;
  camera.model = read_model(map);
  camera.covariance = read_covariance(map, camera.model.lens);
  camera.setting = read_setting(map, camera.model);
  camera.quality = read_quality(map);
  map.finish();
  check_invertible(map, camera.model);
  return camera;
}

std::string format_camera_file(const std::string& head, const CalibratedCamera& camera) {
  const CameraModel& model = camera.model;
  const std::vector<std::string>& names = camera_parameter_names(model.lens);
  std::string out = head;
  out += fmt::format("model: {}\nimage_size_px: [{}, {}]\nparameters:\n", lens_model_name(model.lens),
                     model.width_px, model.height_px);
  for (std::size_t i = 0; i < names.size(); ++i) {
    out += fmt::format("  {}: {}\n", names[i], model.parameters[static_cast<Eigen::Index>(i)]);
  }
  if (std::isfinite(model.valid_radius)) out += fmt::format("valid_radius: {}\n", model.valid_radius);
  if (camera.covariance.size() > 0) {
    out += "covariance:  # rows in the order of the parameters\n";
    for (std::size_t i = 0; i < names.size(); ++i) {
      const Eigen::RowVectorXd row = camera.covariance.row(static_cast<Eigen::Index>(i));
      out += fmt::format("  {}: [{}]\n", names[i], fmt::join(row.data(), row.data() + row.size(), ", "));
    }
  }
  return out + format_setting(camera.setting) + format_quality(camera.quality);
}

}  // namespace hexcal
