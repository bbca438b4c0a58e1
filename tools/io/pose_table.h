#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "kinematics/geometry/pose.h"
#include "photogrammetry/photograph/input_file.h"

namespace hexcal {

/// Columns of a pose in every table, in the order of Pose::vector().
inline constexpr std::array kPoseColumns{"x_mm", "y_mm", "z_mm", "roll_deg", "pitch_deg", "yaw_deg"};
/// What one of column i of a pose is in mm or rad: files carry degrees, memory carries radians.
[[nodiscard]] constexpr double pose_column_unit(std::size_t i) { return i < 3 ? 1.0 : kRadPerDeg; }

/// The six numbers of a pose, an error or their sigmas as files and tables carry them (mm and deg) from
/// memory's mm and rad, and back.
[[nodiscard]] inline Vector6d mm_deg(Vector6d mm_rad) {
  mm_rad.tail<3>() *= kDegPerRad;
  return mm_rad;
}
[[nodiscard]] inline Vector6d mm_rad(Vector6d mm_deg) {
  mm_deg.tail<3>() *= kRadPerDeg;
  return mm_deg;
}

/// One row of targets.csv, poses.csv or predicted_poses.csv. Absent columns are absent here.
struct PoseRecord {
  std::string id;
  std::string status = "ok";      ///< "ok", "suspect: why" with numbers, or why there is no pose
  std::optional<Pose> pose;       ///< absent when the row has no numbers (a failed pose)
  std::optional<Vector6d> sigma;  ///< mm and rad
  std::optional<int> images;
  std::optional<int> markers;
  std::optional<double> rms_px;
  std::string remarks{};  ///< what should be known of a pose that is ok
};

/// True of a status that begins with the word suspect: measured, but something contradicts it.
[[nodiscard]] bool is_suspect(const std::string& status);

/// Reads a pose table (columns pose,x_mm,...,yaw_deg and optional others). Duplicate ids are an error. A row
/// whose status is neither "ok" nor "suspect" may leave its numbers empty; any other row must have all six.
[[nodiscard]] std::vector<PoseRecord> read_pose_table(const std::filesystem::path& path,
                                                      ReadFor purpose = ReadFor::input);

enum class PoseColumns {
  target,     ///< pose,x_mm,...,yaw_deg
  predicted,  ///< pose,status,x_mm,...,yaw_deg
  measured,   ///< pose,status,x_mm,...,yaw_deg,sigma_x_mm,...,sigma_yaw_deg,images,markers,rms_px,remarks
};

/// Text of a pose table; `head` is its comment lines. Numbers carry 1e-6 mm and 1e-7 deg.
[[nodiscard]] std::string format_pose_table(const std::string& head, const std::vector<PoseRecord>& records,
                                            PoseColumns columns);

/// One row of legs.csv or actuators.csv: actuator readings q1..q6 in actuator units.
struct LegRecord {
  std::string id;
  std::string status = "ok";
  std::optional<Vector6d> readings;
  Vector6d approach = Vector6d::Zero();  ///< +1 growing, -1 shrinking, 0 any; columns where a record has one
};

[[nodiscard]] std::vector<LegRecord> read_leg_table(const std::filesystem::path& path);
[[nodiscard]] std::string format_leg_table(const std::string& head, const std::vector<LegRecord>& records,
                                           bool with_status);

}  // namespace hexcal
