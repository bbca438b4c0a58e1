#include "tools/io/hexapod_file.h"

#include <fmt/format.h>

#include "kinematics/geometry/input_error.h"
#include "tools/io/yaml_map.h"

namespace hexcal {
namespace {

std::array<Eigen::Vector3d, 6> six_points(const YamlMap& map, const std::string& key) {
  const std::vector<Eigen::Vector3d> points = map.vectors3(key, 6);
  std::array<Eigen::Vector3d, 6> six;
  std::copy(points.begin(), points.end(), six.begin());
  return six;
}

std::array<Actuator, 6> read_actuators(const YamlMap& map) {
  const auto six = [&map](const std::string& key, double fallback) {
    return map.has(key) ? map.numbers_or_one(key, 6) : std::vector<double>(6, fallback);
  };
  const std::vector<double> min_mm = map.numbers_or_one("min_mm", 6);
  const std::vector<double> max_mm = map.numbers_or_one("max_mm", 6);
  const std::vector<double> offset_mm = six("offset_mm", 0);
  const std::vector<double> mm_per_unit = six("mm_per_unit", 1);
  map.finish();
  std::array<Actuator, 6> actuators;
  for (std::size_t i = 0; i < 6; ++i) actuators[i] = {offset_mm[i], mm_per_unit[i], min_mm[i], max_mm[i]};
  return actuators;
}

JointLimits read_joint_limits(const YamlMap& map) {
  JointLimits limits;
  limits.base_rad = map.number("base_deg") * kRadPerDeg;
  limits.platform_rad = map.number("platform_deg") * kRadPerDeg;
  if (map.has("base_axes_deg")) {
    const std::vector<double> axes = map.numbers("base_axes_deg", 2);
    limits.base_axes_rad = {axes[0] * kRadPerDeg, axes[1] * kRadPerDeg};
  }
  map.finish();
  return limits;
}

ScrewLead read_screw(const YamlMap& map) {
  ScrewLead screw{map.number("lead_mm"), six_points(map, "base_axes"), six_points(map, "platform_axes")};
  map.finish();
  for (auto* axes : {&screw.base_axes, &screw.platform_axes}) {
    for (Eigen::Vector3d& axis : *axes) {
      if (!(axis.norm() > 1e-9)) map.fail("base_axes", "an axis has no direction");
      axis.normalize();
    }
  }
  return screw;
}

std::string triple(const Eigen::Vector3d& v) { return fmt::format("[{}, {}, {}]", v.x(), v.y(), v.z()); }

std::string triples(const std::string& key, const std::array<Eigen::Vector3d, 6>& points,
                    const std::string& indent = "") {
  std::string text = indent + key + ":\n";
  for (const Eigen::Vector3d& p : points) text += indent + "  - " + triple(p) + "\n";
  return text;
}

std::string motion(const std::string& key, const Rigid3& b_from_a) {
  return fmt::format("{}: {{xyz_mm: {}, rpy_deg: {}}}\n", key, triple(b_from_a.translation),
                     triple(rpy_from_quaternion(b_from_a.rotation) * kDegPerRad));
}

template <class Field>
std::string six_numbers(const std::array<Actuator, 6>& actuators, Field field) {
  bool same = true;
  for (const Actuator& a : actuators) same = same && a.*field == actuators[0].*field;
  if (same) return fmt::format("{}", actuators[0].*field);
  std::string text;
  for (const Actuator& a : actuators) text += fmt::format("{}{}", text.empty() ? "" : ", ", a.*field);
  return "[" + text + "]";
}

}  // namespace

PlatformGeometry hexapod_from_yaml(const YamlMap& map) {
  PlatformGeometry geometry;
  geometry.base_joints_mm = six_points(map, "base_joints_mm");
  geometry.platform_joints_mm = six_points(map, "platform_joints_mm");
  geometry.B_from_UG = map.rigid3("B_from_UG");
  geometry.P_from_LG = map.rigid3("P_from_LG");
  const YamlMap home = map.map("home");
  geometry.gd_mm = home.number("gd_mm");
  if (home.has("min_gap_mm")) geometry.min_gap_mm = home.number("min_gap_mm");
  home.finish();
  geometry.actuators = read_actuators(map.map("actuators"));
  if (map.has("joint_limits")) geometry.joint_limits = read_joint_limits(map.map("joint_limits"));
  if (map.has("leg_radius_mm")) geometry.leg_radius_mm = map.number("leg_radius_mm");
  if (map.has("screw")) geometry.screw = read_screw(map.map("screw"));
  map.finish();
  if (const auto fault = geometry_fault(geometry)) throw InputError(map.path().string() + ": " + *fault);
  return geometry;
}

PlatformGeometry read_hexapod_file(const std::filesystem::path& path) {
  return hexapod_from_yaml(YamlMap::read(path));
}

PlatformGeometry parse_hexapod(const std::string& text, const std::filesystem::path& path) {
  return hexapod_from_yaml(YamlMap::parse(text, path));
}

std::string hexapod_text(const std::string& head, const PlatformGeometry& geometry) {
  std::string text = head;
  text += triples("base_joints_mm", geometry.base_joints_mm);
  text += triples("platform_joints_mm", geometry.platform_joints_mm);
  text += motion("B_from_UG", geometry.B_from_UG);
  text += motion("P_from_LG", geometry.P_from_LG);
  text += fmt::format("home: {{gd_mm: {}", geometry.gd_mm);
  if (geometry.min_gap_mm) text += fmt::format(", min_gap_mm: {}", *geometry.min_gap_mm);
  text += "}\n";
  const auto& actuators = geometry.actuators;
  text += fmt::format("actuators: {{min_mm: {}, max_mm: {}, offset_mm: {}, mm_per_unit: {}}}\n",
                      six_numbers(actuators, &Actuator::min_mm), six_numbers(actuators, &Actuator::max_mm),
                      six_numbers(actuators, &Actuator::offset_mm),
                      six_numbers(actuators, &Actuator::mm_per_unit));
  if (geometry.joint_limits) {
    const JointLimits& limits = *geometry.joint_limits;
    text += fmt::format("joint_limits: {{base_deg: {}, platform_deg: {}", limits.base_rad * kDegPerRad,
                        limits.platform_rad * kDegPerRad);
    if (limits.base_axes_rad) {
      text += fmt::format(", base_axes_deg: [{}, {}]", (*limits.base_axes_rad)[0] * kDegPerRad,
                          (*limits.base_axes_rad)[1] * kDegPerRad);
    }
    text += "}\n";
  }
  if (geometry.leg_radius_mm) text += fmt::format("leg_radius_mm: {}\n", *geometry.leg_radius_mm);
  if (geometry.screw) {
    text += fmt::format("screw:\n  lead_mm: {}\n", geometry.screw->lead_mm);
    text += triples("base_axes", geometry.screw->base_axes, "  ");
    text += triples("platform_axes", geometry.screw->platform_axes, "  ");
  }
  return text;
}

}  // namespace hexcal
