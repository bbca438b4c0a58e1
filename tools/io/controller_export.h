#pragma once

#include <string>
#include <vector>

#include "calibration/calibration_model.h"
#include "tools/io/pose_table.h"

namespace hexcal {

/// LinuxCNC's genhexkins for an identified machine: HAL lines (setp genhexkins.base.N.x ..) and INI lines
/// ([KINS], [JOINT_n] SCALE and HOME_OFFSET) in one text, INI lines as comments behind "# ini". genhexkins'
/// joints are strut lengths: SCALE is the actuator's units per mm and HOME_OFFSET the length at reading zero.
/// Throws InputError for a model that is not kinematic or has terms that genhexkins cannot hold.
[[nodiscard]] std::string linuxcnc_text(const std::string& head, const CalibrationModel& model);

/// The machine that such a text describes, to check what was written: joints, offsets, scales and screws; the
/// frames come from `frames`.
[[nodiscard]] PlatformGeometry parse_linuxcnc(const std::string& text, const PlatformGeometry& frames);

/// A PI GCS move list of predicted poses: per pose VMO? (can it be reached?) and MOV, mm and deg, rotations
/// in the order U, V, W. GCS has no command for joint geometry, so corrected targets are all it can take.
[[nodiscard]] std::string pi_gcs_text(const std::string& head, const std::vector<PoseRecord>& predicted);

/// The poses of a GCS move list, in order.
[[nodiscard]] std::vector<Pose> parse_pi_gcs(const std::string& text);

}  // namespace hexcal
