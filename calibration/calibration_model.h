#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "calibration/machine_model.h"
#include "calibration/paper_options.h"

namespace hexcal {

enum class CompensationMethod { nominal, option1, option2, option3, kinematic };

[[nodiscard]] const char* name(CompensationMethod method);
[[nodiscard]] std::optional<CompensationMethod> method_from_name(std::string_view name);

/// What compensation learned about a machine: the contents of model.yaml.
struct CalibrationModel {
  CompensationMethod method = CompensationMethod::nominal;
  PlatformGeometry nominal{};  ///< what the controller knows
  PaperModel paper{};          ///< of option1, option2, option3
  /// Of kinematic. Its B_from_UG and P_from_LG are those in which the poses were measured: nominal's, or,
  /// where they were unknown, the identified ones.
  MachineModel machine{};
};

/// Readings at which the machine stands at a pose given as it was measured; nothing where there are none.
/// `approach`: as below.
[[nodiscard]] std::optional<LegVector> readings_for_pose(const CalibrationModel& model, const Pose& pose,
                                                         const LegVector& approach = LegVector::Zero());

/// Pose, as it would be measured, of the machine at readings; nothing where none is found. `approach`: +1, -1
/// or 0 per leg, the direction of its last movement (of machines with backlash).
[[nodiscard]] std::optional<Pose> pose_for_readings(const CalibrationModel& model, const LegVector& readings,
                                                    const LegVector& approach = LegVector::Zero());

/// The identified machine seen in the hexapod's own frames, in which targets are given. Differs from
/// model.machine only where the measurement's frames were unknown.
[[nodiscard]] MachineModel machine_in_hexapod_frames(const CalibrationModel& model);

}  // namespace hexcal
