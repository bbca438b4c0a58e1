#include "tools/io/symmetric_hexapod.h"

#include <fmt/format.h>

#include <cmath>
#include <set>
#include <vector>

#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/pose.h"
#include "tools/io/csv_table.h"
#include "tools/io/scalar_text.h"

namespace hexcal {
namespace {

std::vector<double> numbers_with_commas(const std::string& text, std::size_t count, const char* flag) {
  std::vector<double> numbers;
  for (std::string_view rest = text; !rest.empty();) {
    const std::size_t comma = std::min(rest.find(','), rest.size());
    const auto number = number_from_text(trimmed(rest.substr(0, comma)));
    rest.remove_prefix(std::min(comma + 1, rest.size()));
    if (!number || !(*number > 0))
      throw InputError(fmt::format("{}: found '{}', wanted {} numbers above 0", flag, text, count));
    numbers.push_back(*number);
  }
  if (numbers.size() != count)
    throw InputError(fmt::format("{}: found {} numbers, wanted {}", flag, numbers.size(), count));
  return numbers;
}

std::array<Eigen::Vector3d, 6> pairs_on_circle(double radius_mm, double pair_mm, double first_deg,
                                               bool first_ahead, const char* name) {
  if (!(pair_mm < 2 * radius_mm)) {
    throw InputError(
        fmt::format("--machine-mm: {} mm between the joints of a {} pair, wanted less than {} mm", pair_mm,
                    name, 2 * radius_mm));
  }
  const double half = std::asin(0.5 * pair_mm / radius_mm);
  std::array<Eigen::Vector3d, 6> joints;
  for (std::size_t leg = 0; leg < 6; ++leg) {
    // Base: leg 1 ahead of 0 deg, legs 2 and 3 around 120 deg; platform: legs 1 and 2 around 60 deg.
    const std::size_t pair = first_ahead ? (leg + 1) / 2 : leg / 2;
    const double side = (leg % 2 == 0) == first_ahead ? half : -half;
    const double angle = (first_deg + 120.0 * static_cast<double>(pair)) * kRadPerDeg + side;
    joints[leg] = {radius_mm * std::cos(angle), radius_mm * std::sin(angle), 0};
  }
  return joints;
}

// Home straight above the base, where the legs' mean length is that of the middle of the stroke.
void place_home(PlatformGeometry& geometry, double shortest_mm, double longest_mm, double gd_mm,
                const char* flag) {
  if (!(longest_mm > shortest_mm))
    throw InputError(
        fmt::format("{}: longest leg {} mm, wanted more than {}", flag, longest_mm, shortest_mm));
  for (Actuator& actuator : geometry.actuators) {
    actuator.min_mm = shortest_mm;
    actuator.max_mm = longest_mm;
  }
  geometry.gd_mm = gd_mm;
  const double wanted = 0.5 * (shortest_mm + longest_mm);
  const auto mean_length = [&geometry](double height_mm) {
    return leg_lengths(geometry, Rigid3::from_translation({0, 0, height_mm})).mean();
  };
  double low = 0;
  double high = 2 * longest_mm;
  if (mean_length(low) > wanted)
    throw InputError(fmt::format("{}: legs of {} mm do not reach from base to platform", flag, wanted));
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (mean_length(middle) < wanted ? low : high) = middle;
  }
  geometry.B_from_UG = Rigid3::from_translation({0, 0, std::round(1000 * (low + gd_mm)) / 1000});
  if (const auto fault = geometry_fault(geometry)) throw InputError(fmt::format("{}: {}", flag, *fault));
}

}  // namespace

SymmetricHexapod parse_symmetric_hexapod(const std::string& text) {
  const std::vector<double> v = numbers_with_commas(text, 6, "--machine-mm");
  return {v[0], v[1], v[2], v[3], v[4], v[5]};
}

PlatformGeometry symmetric_hexapod(const SymmetricHexapod& machine, double gd_mm) {
  PlatformGeometry geometry;
  geometry.base_joints_mm = pairs_on_circle(machine.base_radius_mm, machine.base_pair_mm, 0, true, "base");
  geometry.platform_joints_mm =
      pairs_on_circle(machine.platform_radius_mm, machine.platform_pair_mm, 60, false, "platform");
  place_home(geometry, machine.shortest_mm, machine.longest_mm, gd_mm, "--machine-mm");
  return geometry;
}

PlatformGeometry hexapod_of_joints(const std::filesystem::path& joints, const std::string& leg_mm,
                                   double gd_mm) {
  const CsvTable table = CsvTable::read(joints);
  table.require_columns({"leg", "body", "x_mm", "y_mm", "z_mm"});
  PlatformGeometry geometry;
  std::set<std::pair<std::string, int>> seen;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const int leg = table.integer(row, "leg");
    const std::string& body = table.text(row, "body");
    if (leg < 1 || leg > 6) table.fail(row, "leg", fmt::format("found {}, wanted 1 to 6", leg));
    if (body != "base" && body != "platform")
      table.fail(row, "body", fmt::format("found '{}', wanted base or platform", body));
    if (!seen.emplace(body, leg).second) table.fail(row, "leg", "this joint stands twice");
    auto& bodies = body == "base" ? geometry.base_joints_mm : geometry.platform_joints_mm;
    bodies[static_cast<std::size_t>(leg - 1)] = {table.number(row, "x_mm"), table.number(row, "y_mm"),
                                                 table.number(row, "z_mm")};
  }
  if (seen.size() != 12)
    throw InputError(
        fmt::format("{}: {} joints, wanted 12: base and platform of 6 legs", joints.string(), seen.size()));
  if (leg_mm.empty()) throw InputError("--leg-mm is missing, wanted shortest and longest leg with a comma");
  const std::vector<double> strokes = numbers_with_commas(leg_mm, 2, "--leg-mm");
  place_home(geometry, strokes[0], strokes[1], gd_mm, "--leg-mm");
  return geometry;
}

}  // namespace hexcal
