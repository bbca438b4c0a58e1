#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/calibration_model.h"
#include "calibration/identify.h"

namespace hexcal {

enum class CommandStatus {
  ok,
  out_of_stroke,  ///< a leg would leave its stroke
  joint_limit,    ///< a joint would turn too far, legs would touch or the machine turn inside out
  no_pose,        ///< the controller's geometry has no pose with these legs
  withheld,       ///< the measured poses contradict the machine (machine_doubt.h)
};

/// What to tell the machine so that it reaches one target.
struct CorrectedCommand {
  std::string id;
  CommandStatus status = CommandStatus::no_pose;
  std::string reason;             ///< one line, empty when ok
  Pose target;                    ///< in the hexapod's frames
  std::optional<Pose> predicted;  ///< equivalent pose for a controller that knows the nominal geometry only
  std::optional<LegVector> readings;
  std::optional<Vector6d> sigma;  ///< predicted error that remains, mm and rad; of kinematic only
};

struct Target {
  std::string id;
  Pose pose;
};

/// Readings by the model's exact inverse kinematics; the equivalent pose by nominal forward kinematics, whose
/// legs agree with the readings to 1e-9 mm. Strokes and joints are checked on the corrected command.
/// `identified` gives the sigmas: parameters and leg noise propagated to the pose. `approach`: +1, -1 or 0
/// per leg, the direction from which the machine is going to reach every target; identified backlash is then
/// compensated.
[[nodiscard]] std::vector<CorrectedCommand> compensate(const CalibrationModel& model,
                                                       const std::vector<Target>& targets,
                                                       const IdentifyResult* identified = nullptr,
                                                       const LegVector& approach = LegVector::Zero());

/// Sigma of x .. yaw that an identified machine's pose has at readings for `pose`: uncertainty of the
/// parameters, the legs' own noise, a drift and, of legs that come from an unknown direction (`approach` 0),
/// half their backlash. `pose` in the frames of identified.machine.
[[nodiscard]] Vector6d predicted_sigma(const IdentifyResult& identified, const Pose& pose,
                                       const LegVector& approach = LegVector::Zero());

}  // namespace hexcal
