#include "tools/io/observation_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <map>
#include <set>

#include "kinematics/forward.h"
#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/median.h"
#include "kinematics/inverse.h"
#include "tools/io/covariance_file.h"
#include "tools/io/csv_table.h"
#include "tools/io/pose_table.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

// Guess of the noise where nothing is known of it: only its ratio of mm to deg matters, and only at first.
constexpr double kGuessedSigmaMm = 0.1;
constexpr double kGuessedSigmaDeg = 0.03;
// The joint covariance is dense: 6N x 6N.
constexpr std::size_t kMostJointPoses = 1000;

struct Legs {
  LegVector readings;
  LegVector approach = LegVector::Zero();
};

std::map<std::string, Legs> read_legs(const fs::path& path) {
  std::map<std::string, Legs> legs;
  for (const LegRecord& record : read_leg_table(path))
    if (record.readings) legs[record.id].readings = *record.readings;
  const CsvTable table = CsvTable::read(path);
  if (!table.has_column("approach1")) return legs;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const auto found = legs.find(table.text(row, "pose"));
    for (Eigen::Index k = 0; k < 6 && found != legs.end(); ++k) {
      const std::string column = fmt::format("approach{}", k + 1);
      const int direction = table.integer(row, column);
      if (std::abs(direction) > 1)
        table.fail(row, column, fmt::format("found {}, wanted -1, 0 or 1", direction));
      found->second.approach[k] = direction;
    }
  }
  return legs;
}

PoseObservation read_row(const CsvTable& table, std::size_t row) {
  PoseObservation pose;
  pose.id = table.text(row, "pose");
  Vector6d v = Vector6d::Zero();
  for (std::size_t i = 0; i < 6; ++i) {
    pose.observed[i] = table.has_column(kPoseColumns[i]) && !table.text(row, kPoseColumns[i]).empty();
    if (pose.observed[i])
      v[static_cast<Eigen::Index>(i)] = table.number(row, kPoseColumns[i]) * pose_column_unit(i);
  }
  pose.measured = Pose::from_vector(v);
  return pose;
}

bool read_sigma(const CsvTable& table, std::size_t row, PoseObservation& pose) {
  Vector6d sigma;
  for (std::size_t i = 0; i < 6; ++i) {
    const std::string column = fmt::format("sigma_{}", kPoseColumns[i]);
    const auto k = static_cast<Eigen::Index>(i);
    sigma[k] = 0;
    if (!pose.observed[i]) continue;
    const auto value = table.has_column(column) ? table.optional_number(row, column) : std::nullopt;
    if (!value) return false;
    if (*value < 0) table.fail(row, column, fmt::format("found {}, wanted 0 or more", *value));
    sigma[k] = *value * pose_column_unit(i);
  }
  pose.covariance = sigma.cwiseAbs2().asDiagonal();
  return true;
}

void read_covariance(const fs::path& path, ObservationSet& set) {
  std::map<std::string, Eigen::Index> index;
  for (std::size_t i = 0; i < set.poses.size(); ++i) index[set.poses[i].id] = static_cast<Eigen::Index>(i);
  std::set<std::string> seen;
  const auto n = static_cast<Eigen::Index>(set.poses.size());
  const bool joint = set.poses.size() <= kMostJointPoses;
  if (joint) set.joint_covariance.setZero(6 * n, 6 * n);
  for (const PoseCovariance& entry : read_pose_covariances(path)) {
    const auto a = index.find(entry.a);
    const auto b = index.find(entry.b);
    if (a == index.end() || b == index.end()) continue;
    Matrix6d block = entry.covariance;
    if (a == b) {
      seen.insert(a->first);
      block = (0.5 * (block + block.transpose())).eval();
      set.poses[static_cast<std::size_t>(a->second)].covariance = block;
    }
    if (!joint) continue;
    set.joint_covariance.block<6, 6>(6 * a->second, 6 * b->second) = block;
    set.joint_covariance.block<6, 6>(6 * b->second, 6 * a->second) = block.transpose();
  }
  for (const PoseObservation& pose : set.poses)
    if (seen.count(pose.id) == 0 && !pose.is_definition)
      throw InputError(fmt::format("{}: no row for pose '{}' with itself", path.string(), pose.id));
}

// Millimetres and metres, degrees and radians differ by so much that sizes tell.
void check_units(const fs::path& path, const ObservationSet& set) {
  std::vector<double> ratio_mm;
  std::vector<double> ratio_deg;
  for (const PoseObservation& pose : set.poses) {
    if (!pose.target || pose.is_definition || !pose.complete()) continue;
    const double target_mm = pose.target->position_mm.norm();
    const double target_rad = pose.target->rpy_rad.norm();
    if (target_mm > 2) ratio_mm.push_back(pose.measured.position_mm.norm() / target_mm);
    if (target_rad > 0.02) ratio_deg.push_back(pose.measured.rpy_rad.norm() / target_rad);
  }
  const auto typical = [](const std::vector<double>& ratios) {
    return ratios.size() < 3 ? 1.0 : median(ratios);
  };
  const double mm = typical(ratio_mm);
  const double deg = typical(ratio_deg);
  if (mm < 0.01)
    throw InputError(fmt::format("{}: positions are {:.0f} times smaller than the targets, metres? wanted mm",
                                 path.string(), 1 / mm));
  if (mm > 100)
    throw InputError(fmt::format("{}: positions are {:.0f} times larger than the targets, wanted both in mm",
                                 path.string(), mm));
  if (deg < 1.0 / 30)
    throw InputError(fmt::format("{}: angles are {:.0f} times smaller than the targets, radians? wanted deg",
                                 path.string(), 1 / deg));
  if (deg > 30)
    throw InputError(fmt::format("{}: angles are {:.0f} times larger than the targets, wanted both in deg",
                                 path.string(), deg));
}

void check_strokes(const PlatformGeometry& nominal, const fs::path& path, const ObservationSet& set) {
  for (const PoseObservation& pose : set.poses) {
    const LegVector lengths = lengths_from_readings(nominal, pose.readings);
    for (std::size_t leg = 0; leg < 6; ++leg) {
      const Actuator& actuator = nominal.actuators[leg];
      const double length = lengths[static_cast<Eigen::Index>(leg)];
      // A hand-measured scale may be off by several percent of the stroke.
      const double slack = 0.15 * (actuator.max_mm - actuator.min_mm);
      if (length < actuator.min_mm - slack || length > actuator.max_mm + slack) {
        throw InputError(fmt::format(
            "{}: pose '{}': leg {} reads {:.6g}, which is a length of {:.6g} mm, wanted {:.6g} to {:.6g} mm",
            path.string(), pose.id, leg + 1, pose.readings[static_cast<Eigen::Index>(leg)], length,
            actuator.min_mm, actuator.max_mm));
      }
    }
  }
}

}  // namespace

ObservationTable read_observations(const PlatformGeometry& nominal, const ObservationFiles& files,
                                   const ObservationDefaults& defaults) {
  const CsvTable table = CsvTable::read(files.poses);
  table.require_columns({"pose"});
  std::map<std::string, Pose> targets;
  if (files.targets) {
    for (const PoseRecord& record : read_pose_table(*files.targets))
      if (record.pose) targets[record.id] = *record.pose;
  }
  std::map<std::string, Legs> legs;
  if (files.legs) legs = read_legs(*files.legs);
  if (!files.targets && !files.legs)
    throw InputError(
        fmt::format("{}: measured poses need the targets or the readings at which they were taken",
                    files.poses.string()));

  ObservationTable out;
  std::set<std::string> seen;
  bool sigmas = true;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    PoseObservation pose = read_row(table, row);
    if (pose.id.empty()) table.fail(row, "pose", "is empty, wanted a pose id");
    if (!seen.insert(pose.id).second) table.fail(row, "pose", fmt::format("pose '{}' stands twice", pose.id));
    const std::string status = table.has_column("status") ? table.text(row, "status") : "ok";
    if (status != "ok" && !(is_suspect(status) && defaults.with_suspect)) {
      out.left_out.push_back(
          {pose.id, is_suspect(status) ? status : fmt::format("not measured: {}", status)});
      continue;
    }
    if (std::none_of(pose.observed.begin(), pose.observed.end(), [](bool one) { return one; }))
      table.fail(row, "pose", fmt::format("pose '{}' has no coordinate, wanted at least one", pose.id));
    const bool known = read_sigma(table, row, pose);
    pose.is_definition =
        known && pose.complete() && pose.covariance.isZero(0) && pose.measured.vector().isZero(0);
    sigmas = sigmas && known;
    if (const auto target = targets.find(pose.id); target != targets.end()) {
      pose.target = target->second;
    } else if (pose.is_definition) {
      pose.target = Pose{};
    }
    if (const auto found = legs.find(pose.id); found != legs.end()) {
      pose.readings = found->second.readings;
      pose.approach = found->second.approach;
      const ForwardResult reached =
          pose.target ? ForwardResult{}
                      : forward_kinematics(nominal, lengths_from_readings(nominal, pose.readings));
      if (reached.status == ForwardStatus::converged)
        pose.target = nominal.pose_from_B_from_P(*reached.B_from_P);
    } else if (pose.target && !(files.legs && !pose.is_definition)) {
      pose.readings = readings_at(nominal, nominal.B_from_P(*pose.target));
    } else {
      out.left_out.push_back({pose.id, files.legs ? "no readings" : "no target"});
      continue;
    }
    out.observations.poses.push_back(pose);
  }
  ObservationSet& set = out.observations;
  if (set.poses.empty()) {
    throw InputError(fmt::format("{}: no pose has a {}, wanted the same ids as in {}", files.poses.string(),
                                 files.legs ? "row of readings" : "target",
                                 (files.legs ? *files.legs : *files.targets).string()));
  }
  if (files.covariance) {
    read_covariance(*files.covariance, set);
  } else if (!sigmas) {
    set.covariance_known = defaults.position_sigma_mm && defaults.orientation_sigma_deg;
    const double mm = defaults.position_sigma_mm.value_or(kGuessedSigmaMm);
    const double rad = defaults.orientation_sigma_deg.value_or(kGuessedSigmaDeg) * kRadPerDeg;
    Vector6d variance;
    variance << Eigen::Vector3d::Constant(mm * mm), Eigen::Vector3d::Constant(rad * rad);
    for (PoseObservation& pose : set.poses) pose.covariance = variance.asDiagonal();
  }
  if (defaults.frames_known) check_units(files.poses, set);
  check_strokes(nominal, files.legs ? *files.legs : *files.targets, set);
  return out;
}

}  // namespace hexcal
