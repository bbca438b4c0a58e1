#include "tools/hexcal/machine_flags.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "kinematics/geometry/input_error.h"
#include "tools/io/hexapod_file.h"
#include "tools/io/model_file.h"
#include "tools/io/pose_table.h"

namespace hexcal {

void MachineFlags::add_to(CLI::App& command) {
  command.add_option("--hexapod", hexapod, "nominal geometry (hexapod.yaml)");
  command.add_option("--model", model, "identified machine (model.yaml), instead of --hexapod");
  command.add_option("--threads", threads, "threads for tables")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
}

std::filesystem::path machine_file(const MachineFlags& flags) {
  return flags.model.empty() ? flags.hexapod : flags.model;
}

Machine read_machine(const MachineFlags& flags) {
  if (flags.hexapod.empty() == flags.model.empty())
    throw InputError("--hexapod, --model: found none or both, wanted exactly one of them");
  if (flags.model.empty()) {
    const PlatformGeometry geometry = read_hexapod_file(flags.hexapod);
    return {geometry, RestState(geometry), std::nullopt};
  }
  const CalibrationModel model = read_model_file(flags.model);
  const PlatformGeometry& geometry =
      model.method == CompensationMethod::kinematic ? model.machine.geometry : model.nominal;
  return {geometry, RestState(geometry), model};
}

Vector6d six_numbers(const std::string& text, const std::string& flag) {
  Vector6d numbers;
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  for (Eigen::Index k = 0; k < 6; ++k) {
    while (at != end && *at == ' ') ++at;
    const auto [stop, error] = std::from_chars(at, end, numbers[k]);
    const bool separated = k == 5 ? stop == end : stop != end && *stop == ',';
    if (error != std::errc() || !separated || !std::isfinite(numbers[k]))
      throw InputError(
          fmt::format("{}: found '{}', wanted six numbers with commas between them", flag, text));
    at = stop + (k == 5 ? 0 : 1);
  }
  return numbers;
}

Pose pose_from_mm_deg(const Vector6d& v) { return Pose::from_vector(mm_rad(v)); }

Vector6d mm_deg_from_pose(const Pose& pose) { return mm_deg(pose.vector()); }

}  // namespace hexcal
