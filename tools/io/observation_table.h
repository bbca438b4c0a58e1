#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibration/observation.h"

namespace hexcal {

struct ObservationFiles {
  std::filesystem::path poses;                      ///< measured poses
  std::optional<std::filesystem::path> targets;     ///< what was commanded
  std::optional<std::filesystem::path> legs;        ///< readings at which the poses were measured
  std::optional<std::filesystem::path> covariance;  ///< of the measured poses, also between poses
};

struct ObservationDefaults {
  /// Noise of poses whose table has no sigmas; without, identification estimates it.
  std::optional<double> position_sigma_mm;
  std::optional<double> orientation_sigma_deg;
  /// Whether measured and commanded poses share their frames, so that their sizes can be compared.
  bool frames_known = true;
  /// Whether poses that something contradicts (status suspect) count too.
  bool with_suspect = false;
};

struct ObservationTable {
  ObservationSet observations;
  struct LeftOut {
    std::string id;
    std::string reason;
  };
  std::vector<LeftOut> left_out;
};

/// Joins the tables by pose id. Readings default to the nominal inverse kinematics of the targets; a target,
/// where only readings are known, is what the nominal machine would reach. In the poses' table a missing
/// column or an empty cell is a coordinate that was not measured, if at least one of each row was. A pose of
/// zeros with sigmas of zero is the home that defines LG. legs.csv may have columns approach1 .. approach6
/// (+1 growing, -1 shrinking). The covariance file has columns pose_a,pose_b,c11,c12,..,c66 (row major, mm
/// and rad, parameters x .. yaw), blocks a = b always and each other pair once. Throws InputError in one
/// line: no pose usable, duplicate ids, poses without target, metres, radians, readings outside the stroke.
[[nodiscard]] ObservationTable read_observations(const PlatformGeometry& nominal,
                                                 const ObservationFiles& files,
                                                 const ObservationDefaults& defaults = {});

}  // namespace hexcal
