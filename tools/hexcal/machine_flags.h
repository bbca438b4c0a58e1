#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibration/calibration_model.h"
#include "kinematics/inverse.h"

namespace hexcal {

/// The machine that a command is told by --hexapod (nominal) or --model (identified).
struct MachineFlags {
  std::filesystem::path hexapod;
  std::filesystem::path model;
  int threads = 2;

  void add_to(CLI::App& command);
};

struct Machine {
  PlatformGeometry geometry;  ///< nominal, or identified where the model holds a geometry
  RestState rest;
  std::optional<CalibrationModel> model;  ///< with --model
};

/// Reads it. Throws InputError unless exactly one of the flags is given.
[[nodiscard]] Machine read_machine(const MachineFlags& flags);

/// The file that was read, for the outputs' first line.
[[nodiscard]] std::filesystem::path machine_file(const MachineFlags& flags);

/// "1,2,3,0.1,0.2,0.3". Throws InputError naming the flag.
[[nodiscard]] Vector6d six_numbers(const std::string& text, const std::string& flag);

/// A pose from x, y, z in mm and roll, pitch, yaw in deg, and back.
[[nodiscard]] Pose pose_from_mm_deg(const Vector6d& v);
[[nodiscard]] Vector6d mm_deg_from_pose(const Pose& pose);

}  // namespace hexcal
