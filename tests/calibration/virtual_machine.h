#pragma once

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "calibration/machine_model.h"
#include "calibration/observation.h"
#include "calibration/statistics.h"
#include "kinematics/forward.h"
#include "kinematics/geometry/covariance.h"

namespace hexcal {

/// Standard deviations of what a machine differs by from its drawing.
struct AsBuiltErrors {
  double joint_mm = 1;
  double offset_mm = 1;
  double scale = 0.005;
};

inline MachineModel as_built(const PlatformGeometry& nominal, const AsBuiltErrors& errors, unsigned seed) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> normal;
  MachineModel machine;
  machine.geometry = nominal;
  for (std::size_t i = 0; i < 6; ++i) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      machine.geometry.base_joints_mm[i][k] += errors.joint_mm * normal(rng);
      machine.geometry.platform_joints_mm[i][k] += errors.joint_mm * normal(rng);
    }
    Actuator& actuator = machine.geometry.actuators[i];
    const double home = leg_lengths(nominal, nominal.home_B_from_P())[static_cast<Eigen::Index>(i)];
    const double relative = errors.scale * normal(rng);
    actuator.offset_mm += errors.offset_mm * normal(rng) - relative * (home - actuator.offset_mm);
    actuator.mm_per_unit *= 1 + relative;
  }
  return machine;
}

struct TargetBox {
  double lateral_mm = 30;
  double vertical_mm = 25;
  double angle_deg = 10;
};

inline std::vector<Pose> random_poses(std::size_t count, const TargetBox& box, unsigned seed) {
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Pose> poses;
  while (poses.size() < count) {
    Vector6d v;
    for (Eigen::Index k = 0; k < 6; ++k)
      v[k] = uniform(rng) * (k < 2 ? box.lateral_mm : k == 2 ? box.vertical_mm : box.angle_deg * kRadPerDeg);
    poses.push_back(Pose::from_vector(v));
  }
  return poses;
}

struct MeasurementNoise {
  double position_mm = 0;
  double angle_deg = 0;
  unsigned seed = 1;
};

/// What the nominal controller does wrong at poses that the machine can take.
inline ErrorStatistics uncompensated(const MachineModel& machine, const PlatformGeometry& nominal,
                                     const std::vector<Pose>& targets) {
  std::vector<PosePair> pairs;
  for (const Pose& target : targets) {
    const LegVector readings = readings_from_lengths(nominal, leg_lengths(nominal, nominal.B_from_P(target)));
    if (const auto actual = machine_pose(machine, readings, target)) pairs.push_back({target, *actual});
  }
  return error_statistics(pairs);
}

/// Of 200 machines the first that is near, or else the nearest: its error ranges over 34 poses of the box
/// are those of the uncompensated machine of Karmakar and Turner (tables 2 to 4: 19.70 mm, 11.12 deg). As
/// theirs, it has no error at home.
inline MachineModel as_built_like_the_paper(const PlatformGeometry& nominal, const TargetBox& box,
                                            unsigned seed) {
  const std::vector<Pose> targets = random_poses(34, box, 34);
  MachineModel nearest;
  double least = std::numeric_limits<double>::infinity();
  for (unsigned draw = 0; draw < 200 && least > 0.1; ++draw) {
    MachineModel machine = as_built(nominal, {8, 8, 0.05}, 1000 * seed + draw);
    PlatformGeometry& geometry = machine.geometry;
    const ForwardResult home = forward_kinematics(
        geometry,
        lengths_from_readings(geometry,
                              readings_from_lengths(nominal, leg_lengths(nominal, nominal.home_B_from_P()))),
        nominal.home_B_from_P());
    if (home.status != ForwardStatus::converged) continue;
    geometry.P_from_LG = inverse(*home.B_from_P) * geometry.B_from_UG * ug_from_lg({}, nominal.gd_mm);
    const ErrorStatistics s = uncompensated(machine, nominal, targets);
    if (s.poses < 34) continue;
    const double distance = std::hypot(std::log(s.position_magnitude_mm / 19.70),
                                       std::log(s.orientation_magnitude_rad * kDegPerRad / 11.12));
    if (distance >= least) continue;
    least = distance;
    nearest = machine;
  }
  return nearest;
}

/// The machine is sent to the targets by the nominal controller and measured with noise. Poses that the real
/// machine cannot take are left out.
inline ObservationSet measured(const MachineModel& machine, const PlatformGeometry& nominal,
                               const std::vector<Pose>& targets, const MeasurementNoise& noise) {
  std::mt19937_64 rng(noise.seed);
  std::normal_distribution<double> normal;
  ObservationSet set;
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(noise.position_mm),
      Eigen::Vector3d::Constant(noise.angle_deg * kRadPerDeg);
  for (const Pose& target : targets) {
    PoseObservation pose;
    pose.id = fmt::format("p{}", set.poses.size() + 1);
    pose.target = target;
    pose.readings = readings_from_lengths(nominal, leg_lengths(nominal, nominal.B_from_P(target)));
    const auto actual = machine_pose(machine, pose.readings, target);
    if (!actual) continue;
    Vector6d v = actual->vector();
    for (Eigen::Index k = 0; k < 6; ++k) v[k] += sigma[k] * normal(rng);
    pose.measured = Pose::from_vector(v);
    pose.covariance = sigma.cwiseMax(1e-9).cwiseAbs2().asDiagonal();
    set.poses.push_back(pose);
  }
  return set;
}

}  // namespace hexcal
