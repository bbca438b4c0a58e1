#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "kinematics/platform.h"

namespace hexcal {

/// How far the virtual hexapod is from its drawing. The sigmas of joints, offsets and scales are inside the
/// kinematic error model, the others (default: absent) are outside.
struct MachineErrors {
  double joint_sigma_mm = 8.0;       ///< each coordinate of each joint centre
  double leg_offset_sigma_mm = 8.0;  ///< each leg's length at mid-stroke
  double leg_scale_sigma = 0.05;     ///< each leg's mm per unit, relative
  /// Of so many machines the first whose error ranges come near the paper's, or else the nearest. The paper's
  /// orientation errors (11 deg beside 20 mm) are larger than nearly any single draw's. 1: follow the sigmas.
  int draws = 200;
  double stroke_wave_mm = 0.0;           ///< amplitude of a wave along the stroke, 40 mm long (spindle pitch)
  double backlash_mm = 0.0;              ///< leg play: the leg stops short of its reading from either side
  double leg_compliance_mm_per_n = 0.0;  ///< leg shortening per axial force under `payload_n`
  double payload_n = 300.0;              ///< weight on the platform

  void validate() const;
};

/// A hexapod with its drawing and its hidden as-built state. In `as_built`, P_from_LG is such that the
/// machine at its home readings has pose zero: LG is the body frame of `from: home` (CONVENTIONS.md).
struct VirtualMachine {
  PlatformGeometry nominal;
  PlatformGeometry as_built;
  MachineErrors errors;
  LegVector wave_phase_rad = LegVector::Zero();
  LegVector home_readings = LegVector::Zero();
};

/// Surrogate of the paper's machine, which publishes no geometry: joints in pairs 24 deg apart, base radius
/// 260 mm, platform radius 150 mm, home height of P 430 mm, strokes 380 to 580 mm.
[[nodiscard]] PlatformGeometry surrogate_geometry();

[[nodiscard]] VirtualMachine make_machine(std::uint64_t seed, const MachineErrors& errors);

/// Readings the controller commands for a pose: inverse kinematics of the drawing.
[[nodiscard]] LegVector commanded_readings(const PlatformGeometry& nominal, const Pose& target);

/// Pose of LG reached with given readings, approached from the readings `before` (backlash); none if a leg
/// leaves its stroke or the platform cannot be assembled.
[[nodiscard]] std::optional<Pose> true_pose(const VirtualMachine& machine, const LegVector& readings,
                                            const LegVector& before);

struct TargetPose {
  std::string id;
  Pose pose;
};

/// `home` and `count` random poses within +-range_mm and +-range_rad per parameter that both the drawing and
/// the as-built machine can reach.
[[nodiscard]] std::vector<TargetPose> random_targets(const VirtualMachine& machine, std::uint64_t seed,
                                                     int count, double range_mm, double range_rad);

}  // namespace hexcal
