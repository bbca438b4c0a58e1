#include "tools/io/controller_export.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <sstream>

#include "kinematics/geometry/input_error.h"
#include "kinematics/screw.h"

namespace hexcal {
namespace {

constexpr std::array kAxes{"x", "y", "z"};
constexpr std::array kGcsAxes{"X", "Y", "Z", "U", "V", "W"};
constexpr const char* kIniPrefix = "# ini ";

}  // namespace

std::string linuxcnc_text(const std::string& head, const CalibrationModel& model) {
  if (model.method != CompensationMethod::kinematic) {
    throw InputError(
        fmt::format("model of method {}: genhexkins holds a geometry, wanted kinematic", name(model.method)));
  }
  if (model.machine.has_extensions() || !model.machine.backlash_mm.isZero(0))
    throw InputError(
        "model: genhexkins has no stroke curves, sag or backlash, wanted a plain kinematic model (compensate "
        "--method geometry)");
  const PlatformGeometry& geometry = model.machine.geometry;
  std::string text = head;
  const auto points = [&](const char* pin, const std::array<Eigen::Vector3d, 6>& all) {
    for (std::size_t i = 0; i < 6; ++i)
      for (std::size_t k = 0; k < 3; ++k)
        text += fmt::format("setp genhexkins.{}.{}.{} {}\n", pin, i, kAxes[k],
                            all[i][static_cast<Eigen::Index>(k)]);
  };
  points("base", geometry.base_joints_mm);
  points("platform", geometry.platform_joints_mm);
  if (geometry.screw) {
    points("base-n", geometry.screw->base_axes);
    points("platform-n", geometry.screw->platform_axes);
    text += fmt::format("setp genhexkins.screw-lead {}\n", geometry.screw->lead_mm);
  }
  const auto ini = [&](const std::string& line) { text += kIniPrefix + line + "\n"; };
  ini("[KINS]");
  ini("KINEMATICS = genhexkins");
  ini("JOINTS = 6");
  for (std::size_t i = 0; i < 6; ++i) {
    const Actuator& actuator = geometry.actuators[i];
    ini(fmt::format("[JOINT_{}]", i));
    ini(fmt::format("SCALE = {}", 1.0 / actuator.mm_per_unit));
    ini(fmt::format("HOME_OFFSET = {}", actuator.offset_mm));
    ini(fmt::format("MIN_LIMIT = {}", actuator.min_mm));
    ini(fmt::format("MAX_LIMIT = {}", actuator.max_mm));
  }
  return text;
}

PlatformGeometry parse_linuxcnc(const std::string& text, const PlatformGeometry& frames) {
  PlatformGeometry geometry = frames;
  std::istringstream lines(text);
  std::size_t joint = 0;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string first;
    words >> first;
    if (first == "setp") {
      std::string pin;
      double value = 0;
      if (!(words >> pin >> value)) throw InputError(fmt::format("'{}': wanted setp PIN NUMBER", line));
      if (pin == "genhexkins.screw-lead") {
        if (!geometry.screw) geometry.screw = screw_with_tangential_axes(frames, 0.0);
        geometry.screw->lead_mm = value;
        continue;
      }
      // genhexkins.GROUP.N.AXIS
      constexpr std::string_view kComponent = "genhexkins.";
      const std::size_t group_end = pin.find('.', kComponent.size());
      if (!pin.starts_with(kComponent) || group_end == std::string::npos || pin.size() != group_end + 4)
        throw InputError(fmt::format("'{}': no such pin", line));
      const std::string group = pin.substr(kComponent.size(), group_end - kComponent.size());
      const auto leg = static_cast<std::size_t>(pin[group_end + 1] - '0');
      const auto axis = static_cast<Eigen::Index>(pin.back() - 'x');
      if (leg > 5 || axis < 0 || axis > 2) throw InputError(fmt::format("'{}': no such pin", line));
      if (group == "base") geometry.base_joints_mm[leg][axis] = value;
      if (group == "platform") geometry.platform_joints_mm[leg][axis] = value;
      if (group == "base-n" || group == "platform-n") {
        if (!geometry.screw) geometry.screw = screw_with_tangential_axes(frames, 0.0);
        (group == "base-n" ? geometry.screw->base_axes : geometry.screw->platform_axes)[leg][axis] = value;
      }
      continue;
    }
    std::string ini, key, equals;
    double value = 0;
    if (first != "#" || !(words >> ini) || ini != "ini" || !(words >> key)) continue;
    constexpr std::string_view kJoint = "[JOINT_";
    if (key.starts_with(kJoint) && key.size() > kJoint.size())
      joint = static_cast<std::size_t>(key[kJoint.size()] - '0');
    if (!(words >> equals >> value) || joint > 5) continue;
    if (key == "SCALE") geometry.actuators[joint].mm_per_unit = 1.0 / value;
    if (key == "HOME_OFFSET") geometry.actuators[joint].offset_mm = value;
  }
  return geometry;
}

std::string pi_gcs_text(const std::string& head, const std::vector<PoseRecord>& predicted) {
  std::string text = head;
  for (const PoseRecord& record : predicted) {
    if (!record.pose || record.status != "ok") {
      text += fmt::format("# {}: {}\n", record.id, record.status);
      continue;
    }
    // U, V, W turn about the moving x, y, z in this order: R = Rx(U) Ry(V) Rz(W).
    const Eigen::Matrix3d r = quaternion_from_rpy(record.pose->rpy_rad).toRotationMatrix();
    const double v = std::atan2(r(0, 2), std::hypot(r(0, 0), r(0, 1)));
    const double u = std::atan2(-r(1, 2), r(2, 2));
    const double w = std::atan2(-r(0, 1), r(0, 0));
    const Eigen::Vector3d& p = record.pose->position_mm;
    const std::array<double, 6> values{p.x(), p.y(), p.z(), u * kDegPerRad, v * kDegPerRad, w * kDegPerRad};
    std::string axes;
    for (std::size_t i = 0; i < 6; ++i) axes += fmt::format(" {} {:.7f}", kGcsAxes[i], values[i]);
    text += fmt::format("# {}\nVMO?{}\nMOV{}\n", record.id, axes, axes);
  }
  return text;
}

std::vector<Pose> parse_pi_gcs(const std::string& text) {
  std::vector<Pose> poses;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string first, axis;
    words >> first;
    if (first != "MOV") continue;
    std::array<double, 6> value{};
    for (std::size_t i = 0; i < 6; ++i)
      if (!(words >> axis >> value[i]) || axis != kGcsAxes[i])
        throw InputError(fmt::format("'{}': wanted MOV X .. W", line));
    const Eigen::Quaterniond q =
        Eigen::Quaterniond(Eigen::AngleAxisd(value[3] * kRadPerDeg, Eigen::Vector3d::UnitX()) *
                           Eigen::AngleAxisd(value[4] * kRadPerDeg, Eigen::Vector3d::UnitY()) *
                           Eigen::AngleAxisd(value[5] * kRadPerDeg, Eigen::Vector3d::UnitZ()));
    poses.push_back({{value[0], value[1], value[2]}, rpy_from_quaternion(q)});
  }
  return poses;
}

}  // namespace hexcal
