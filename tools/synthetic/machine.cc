#include "tools/synthetic/machine.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <numbers>

#include "calibration/statistics.h"
#include "kinematics/forward.h"
#include "kinematics/geometry/input_error.h"
#include "tools/synthetic/random_source.h"

namespace hexcal {
namespace {

constexpr double kBaseRadiusMm = 260;
constexpr double kPlatformRadiusMm = 150;
constexpr double kHalfSpreadDeg = 12;
constexpr double kWaveLengthMm = 40;
// Karmakar and Turner, tables 2 to 4: magnitudes of the uncompensated error ranges over 34 poses. The poses
// are not published; these stand for them.
constexpr double kPaperPositionMm = 19.70;
constexpr double kPaperOrientationDeg = 11.12;
constexpr int kPaperPoses = 34;
constexpr double kPaperRangeMm = 30;
constexpr double kPaperRangeDeg = 12;
constexpr double kNearPaper = 0.1;  // logarithm of the ratio to the paper's

Eigen::Vector3d on_circle(double radius_mm, double angle_deg) {
  return {radius_mm * std::cos(angle_deg * kRadPerDeg), radius_mm * std::sin(angle_deg * kRadPerDeg), 0.0};
}

bool within_strokes(const PlatformGeometry& geometry, const LegVector& lengths_mm) {
  for (std::size_t i = 0; i < 6; ++i) {
    const double length = lengths_mm[static_cast<Eigen::Index>(i)];
    if (length < geometry.actuators[i].min_mm || length > geometry.actuators[i].max_mm) return false;
  }
  return true;
}

// Axial compression of each leg, in N, under a weight at O_P.
LegVector leg_forces_n(const PlatformGeometry& geometry, const Rigid3& B_from_P, double payload_n) {
  Vector6d wrench = Vector6d::Zero();
  wrench[2] = payload_n;
  return leg_jacobian(geometry, B_from_P).transpose().partialPivLu().solve(wrench);
}

std::optional<Rigid3> true_B_from_P(const VirtualMachine& machine, const LegVector& readings,
                                    const LegVector& before) {
  const MachineErrors& errors = machine.errors;
  LegVector lengths = lengths_from_readings(machine.as_built, readings);
  for (Eigen::Index i = 0; i < 6; ++i) {
    lengths[i] += errors.stroke_wave_mm *
                  std::sin(2 * std::numbers::pi * readings[i] / kWaveLengthMm + machine.wave_phase_rad[i]);
    const double way = readings[i] - before[i];
    if (way != 0) lengths[i] -= std::copysign(0.5 * errors.backlash_mm, way);
  }
  if (!within_strokes(machine.as_built, lengths)) return std::nullopt;
  ForwardResult assembled = forward_kinematics(machine.as_built, lengths, machine.nominal.B_from_P(Pose{}));
  if (assembled.status != ForwardStatus::converged) return std::nullopt;
  if (errors.leg_compliance_mm_per_n > 0) {
    const LegVector forces = leg_forces_n(machine.as_built, *assembled.B_from_P, errors.payload_n);
    assembled = forward_kinematics(machine.as_built, lengths - errors.leg_compliance_mm_per_n * forces,
                                   *assembled.B_from_P);
  }
  return assembled.B_from_P;
}

Pose random_pose(RandomSource& random, double range_mm, double range_rad) {
  Pose pose;
  for (Eigen::Index i = 0; i < 3; ++i) pose.position_mm[i] = random.uniform(-range_mm, range_mm);
  for (Eigen::Index i = 0; i < 3; ++i) pose.rpy_rad[i] = random.uniform(-range_rad, range_rad);
  return pose;
}

VirtualMachine draw_machine(RandomSource& random, const MachineErrors& errors) {
  VirtualMachine machine;
  machine.nominal = surrogate_geometry();
  machine.errors = errors;
  machine.home_readings = commanded_readings(machine.nominal, Pose{});
  for (int attempt = 0; attempt < 100; ++attempt) {
    machine.as_built = machine.nominal;
    for (std::size_t i = 0; i < 6; ++i) {
      for (Eigen::Index k = 0; k < 3; ++k) {
        machine.as_built.base_joints_mm[i][k] += errors.joint_sigma_mm * random.normal();
        machine.as_built.platform_joints_mm[i][k] += errors.joint_sigma_mm * random.normal();
      }
      // A scale error turns about the home reading, so that it does not shift the whole leg.
      Actuator& actuator = machine.as_built.actuators[i];
      const double scale_error = errors.leg_scale_sigma * random.normal();
      const auto leg = static_cast<Eigen::Index>(i);
      actuator.mm_per_unit *= 1 + scale_error;
      actuator.offset_mm +=
          errors.leg_offset_sigma_mm * random.normal() - scale_error * machine.home_readings[leg];
      actuator.min_mm -= 20;
      actuator.max_mm += 20;
      machine.wave_phase_rad[leg] = random.uniform(-3.14159, 3.14159);
    }
    const std::optional<Rigid3> home = true_B_from_P(machine, machine.home_readings, machine.home_readings);
    if (!home) continue;  // a draw that cannot even be assembled at home
    const Rigid3 UG_from_LG = ug_from_lg(Pose{}, machine.nominal.gd_mm);
    machine.as_built.P_from_LG = inverse(*home) * machine.as_built.B_from_UG * UG_from_LG;
    return machine;
  }
  throw InputError("the machine errors are so large that the hexapod cannot be assembled at home");
}

// How far the machine's error ranges are from the paper's: length of the logarithms of both ratios.
double distance_from_paper(const VirtualMachine& machine) {
  std::vector<PosePair> pairs;
  RandomSource random(0, 3);
  for (int i = 0; i < kPaperPoses; ++i) {
    const Pose target = random_pose(random, kPaperRangeMm, kPaperRangeDeg * kRadPerDeg);
    const auto actual =
        true_pose(machine, commanded_readings(machine.nominal, target), machine.home_readings);
    if (actual) pairs.push_back({target, *actual});
  }
  if (pairs.size() < kPaperPoses / 2) return std::numeric_limits<double>::infinity();
  const ErrorStatistics s = error_statistics(pairs);
  return std::hypot(std::log(s.position_magnitude_mm / kPaperPositionMm),
                    std::log(s.orientation_magnitude_rad * kDegPerRad / kPaperOrientationDeg));
}

}  // namespace

void MachineErrors::validate() const {
  const auto check = [](const char* name, double value) {
    if (!(value >= 0)) throw InputError(fmt::format("{} is {}, wanted 0 or more", name, value));
  };
  check("joint_sigma_mm", joint_sigma_mm);
  check("leg_offset_sigma_mm", leg_offset_sigma_mm);
  check("leg_scale_sigma", leg_scale_sigma);
  check("stroke_wave_mm", stroke_wave_mm);
  check("backlash_mm", backlash_mm);
  check("leg_compliance_mm_per_n", leg_compliance_mm_per_n);
  check("payload_n", payload_n);
  if (draws < 1) throw InputError(fmt::format("draws is {}, wanted 1 or more", draws));
}

PlatformGeometry surrogate_geometry() {
  PlatformGeometry geometry;
  for (std::size_t pair = 0; pair < 3; ++pair) {
    const double turn = 120.0 * static_cast<double>(pair);
    geometry.base_joints_mm[2 * pair] = on_circle(kBaseRadiusMm, turn + kHalfSpreadDeg);
    geometry.base_joints_mm[2 * pair + 1] = on_circle(kBaseRadiusMm, turn + 120 - kHalfSpreadDeg);
    geometry.platform_joints_mm[2 * pair] = on_circle(kPlatformRadiusMm, turn + 60 - kHalfSpreadDeg);
    geometry.platform_joints_mm[2 * pair + 1] = on_circle(kPlatformRadiusMm, turn + 60 + kHalfSpreadDeg);
  }
  geometry.B_from_UG = Rigid3::from_translation({0, 0, 550});
  geometry.P_from_LG = Rigid3::from_translation({0, 0, 70});
  geometry.gd_mm = 50;
  geometry.actuators.fill({0, 1, 380, 580});
  return geometry;
}

VirtualMachine make_machine(std::uint64_t seed, const MachineErrors& errors) {
  errors.validate();
  RandomSource random(seed, 1);
  VirtualMachine nearest = draw_machine(random, errors);
  if (errors.draws == 1) return nearest;
  double least = distance_from_paper(nearest);
  for (int draw = 1; draw < errors.draws && least > kNearPaper; ++draw) {
    const VirtualMachine machine = draw_machine(random, errors);
    const double distance = distance_from_paper(machine);
    if (distance >= least) continue;
    least = distance;
    nearest = machine;
  }
  return nearest;
}

LegVector commanded_readings(const PlatformGeometry& nominal, const Pose& target) {
  return readings_from_lengths(nominal, leg_lengths(nominal, nominal.B_from_P(target)));
}

std::optional<Pose> true_pose(const VirtualMachine& machine, const LegVector& readings,
                              const LegVector& before) {
  const std::optional<Rigid3> B_from_P = true_B_from_P(machine, readings, before);
  if (!B_from_P) return std::nullopt;
  return machine.as_built.pose_from_B_from_P(*B_from_P);
}

std::vector<TargetPose> random_targets(const VirtualMachine& machine, std::uint64_t seed, int count,
                                       double range_mm, double range_rad) {
  std::vector<TargetPose> targets{{"home", Pose{}}};
  RandomSource random(seed, 2);
  for (int attempt = 0; static_cast<int>(targets.size()) <= count; ++attempt) {
    if (attempt > 1000 * (count + 1)) {
      throw InputError(fmt::format("no reachable poses within +-{:g} mm and +-{:g} deg", range_mm,
                                   range_rad * kDegPerRad));
    }
    const Pose pose = random_pose(random, range_mm, range_rad);
    const LegVector readings = commanded_readings(machine.nominal, pose);
    if (!within_strokes(machine.nominal, lengths_from_readings(machine.nominal, readings))) continue;
    if (!true_pose(machine, readings, machine.home_readings)) continue;
    targets.push_back({fmt::format("p{:03d}", targets.size()), pose});
  }
  return targets;
}

}  // namespace hexcal
