#pragma once

#include <optional>
#include <vector>

#include "kinematics/platform.h"

namespace hexcal {

/// Smooth error of one leg's length along its stroke: sum of c_j P_(j+2)(s), P the Legendre polynomials, s
/// the reading mapped from [low, high] to [-1, 1] and held at the ends. Constant and linear terms are the
/// actuator's offset and scale.
struct StrokeCurve {
  double low = 0;  ///< readings between which it was identified
  double high = 0;
  std::vector<double> coefficients_mm;

  [[nodiscard]] double value_mm(double reading) const;
  [[nodiscard]] double slope_mm_per_unit(double reading) const;
};

/// P_2(s), P_3(s), ... P_(count+1)(s).
[[nodiscard]] std::vector<double> legendre_terms(double s, std::size_t count);

/// A machine as identified: geometry, and what else moves its legs. With joint positions a (frame B) and b
/// (frame P) a leg fulfils
///   |R b + t - a| = offset + mm_per_unit q + curve(q) + sag(pose) + approach backlash / 2,
/// where screws in the geometry add their lead times the leg's twist on the left.
struct MachineModel {
  PlatformGeometry geometry{};
  std::array<StrokeCurve, 6> stroke_curves{};
  /// Sag of the legs under the moving mass: compliance times weight (mm), and that times the centre of mass
  /// in P (mm^2). Legs share one compliance; their forces come from the force Jacobian.
  Eigen::Vector4d sag = Eigen::Vector4d::Zero();
  /// Width of the play in each leg, mm; half of it is added when the leg was approached growing, half taken
  /// away when shrinking.
  LegVector backlash_mm = LegVector::Zero();

  [[nodiscard]] bool has_extensions() const;
};

/// d(leg sag) / d(MachineModel::sag), 6x4, in the order of that vector.
[[nodiscard]] Eigen::Matrix<double, 6, 4> sag_basis(const PlatformGeometry& geometry, const Rigid3& B_from_P);

/// Length of each leg that its actuator has to give, in mm: all terms of the equation above but those of the
/// reading.
[[nodiscard]] LegVector actuator_lengths(const MachineModel& machine, const Pose& pose);

/// Readings with which the machine stands at the pose (exact inverse kinematics). `approach`: +1, -1 or 0 per
/// leg, the direction of its last movement.
[[nodiscard]] LegVector machine_readings(const MachineModel& machine, const Pose& pose,
                                         const LegVector& approach = LegVector::Zero());

/// Lengths given by the actuators at readings: offset + mm_per_unit q + curve(q) + approach backlash / 2.
[[nodiscard]] LegVector actuator_output(const MachineModel& machine, const LegVector& readings,
                                        const LegVector& approach = LegVector::Zero());

/// Pose of the machine at readings (forward kinematics from `start`); nothing if none was found.
[[nodiscard]] std::optional<Pose> machine_pose(const MachineModel& machine, const LegVector& readings,
                                               const Pose& start = {},
                                               const LegVector& approach = LegVector::Zero());

/// d(leg lengths) / d(x, y, z, roll, pitch, yaw) at a pose: 6x6, mm per mm and mm per rad.
[[nodiscard]] Matrix6d leg_by_pose_jacobian(const PlatformGeometry& geometry, const Pose& pose);

}  // namespace hexcal
