#include "calibration/machine_model.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "kinematics/forward.h"
#include "kinematics/geometry/covariance.h"
#include "kinematics/screw.h"

namespace hexcal {
namespace {

constexpr int kMaxPoseIterations = 50;

double stroke_position(const StrokeCurve& curve, double reading) {
  const double s = 2.0 * (reading - curve.low) / (curve.high - curve.low) - 1.0;
  return std::clamp(s, -1.0, 1.0);
}

}  // namespace

std::vector<double> legendre_terms(double s, std::size_t count) {
  std::vector<double> terms;
  double previous = 1.0;
  double current = s;
  for (std::size_t n = 1; n <= count; ++n) {  // (n + 1) P_(n+1) = (2 n + 1) s P_n - n P_(n-1)
    const double k = static_cast<double>(n);
    const double next = ((2 * k + 1) * s * current - k * previous) / (k + 1);
    previous = current;
    current = next;
    terms.push_back(current);
  }
  return terms;
}

double StrokeCurve::value_mm(double reading) const {
  if (coefficients_mm.empty()) return 0.0;
  const std::vector<double> terms = legendre_terms(stroke_position(*this, reading), coefficients_mm.size());
  double sum = 0;
  for (std::size_t j = 0; j < terms.size(); ++j) sum += coefficients_mm[j] * terms[j];
  return sum;
}

double StrokeCurve::slope_mm_per_unit(double reading) const {
  if (coefficients_mm.empty()) return 0.0;
  const double h = 1e-4 * (high - low);
  return (value_mm(reading + h) - value_mm(reading - h)) / (2 * h);
}

bool MachineModel::has_extensions() const {
  return !sag.isZero(0) ||
         std::any_of(stroke_curves.begin(), stroke_curves.end(),
                     [](const StrokeCurve& curve) { return !curve.coefficients_mm.empty(); });
}

Eigen::Matrix<double, 6, 4> sag_basis(const PlatformGeometry& geometry, const Rigid3& B_from_P) {
  // Unit weight at the centre of mass c: force -z, moment (R c) x (-z) about O_P. Leg forces f, positive in
  // tension along u from base to platform, balance it: J^T f = wrench of the weight; a leg pulled longer
  // by f grows by compliance * f.
  Eigen::Matrix<double, 6, 4> wrench = Eigen::Matrix<double, 6, 4>::Zero();
  const Eigen::Vector3d down(0, 0, -1);
  wrench.col(0).head<3>() = down;
  for (int i = 0; i < 3; ++i)
    wrench.col(1 + i).tail<3>() = (B_from_P.rotation * Eigen::Vector3d::Unit(i)).cross(down);
  return leg_jacobian(geometry, B_from_P).transpose().partialPivLu().solve(wrench);
}

LegVector actuator_lengths(const MachineModel& machine, const Pose& pose) {
  const Rigid3 B_from_P = machine.geometry.B_from_P(pose);
  LegVector lengths = actuated_lengths(machine.geometry, B_from_P);
  if (!machine.sag.isZero(0)) lengths -= sag_basis(machine.geometry, B_from_P) * machine.sag;
  return lengths;
}

LegVector actuator_output(const MachineModel& machine, const LegVector& readings, const LegVector& approach) {
  LegVector lengths = lengths_from_readings(machine.geometry, readings);
  for (std::size_t k = 0; k < 6; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    lengths[i] += machine.stroke_curves[k].value_mm(readings[i]);
  }
  return lengths + 0.5 * machine.backlash_mm.cwiseProduct(approach);
}

LegVector machine_readings(const MachineModel& machine, const Pose& pose, const LegVector& approach) {
  const LegVector lengths = actuator_lengths(machine, pose);
  LegVector readings =
      readings_from_lengths(machine.geometry, lengths - 0.5 * machine.backlash_mm.cwiseProduct(approach));
  // Newton per leg; a curve's slope is a few percent of the scale, so a few steps reach rounding.
  for (int step = 0; step < 20 && machine.has_extensions(); ++step) {
    const LegVector excess = actuator_output(machine, readings, approach) - lengths;
    for (std::size_t k = 0; k < 6; ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      readings[i] -= excess[i] / (machine.geometry.actuators[k].mm_per_unit +
                                  machine.stroke_curves[k].slope_mm_per_unit(readings[i]));
    }
    if (excess.cwiseAbs().maxCoeff() < 1e-12 * lengths.cwiseAbs().maxCoeff()) break;
  }
  return readings;
}

std::optional<Pose> machine_pose(const MachineModel& machine, const LegVector& readings, const Pose& start,
                                 const LegVector& approach) {
  const LegVector output = actuator_output(machine, readings, approach);
  LegVector lengths = output;
  Pose pose = start;
  for (int step = 0; step < kMaxPoseIterations; ++step) {
    const ForwardResult solved =
        forward_kinematics(machine.geometry, lengths, machine.geometry.B_from_P(pose));
    if (solved.status != ForwardStatus::converged) return std::nullopt;
    pose = machine.geometry.pose_from_B_from_P(*solved.B_from_P);
    if (!machine.has_extensions()) return pose;
    // Sag varies little with the pose, so that the fixed point contracts fast.
    const LegVector excess = actuator_lengths(machine, pose) - output;
    if (excess.cwiseAbs().maxCoeff() < 1e-10) return pose;
    lengths -= excess;
  }
  return std::nullopt;
}

Matrix6d leg_by_pose_jacobian(const PlatformGeometry& geometry, const Pose& pose) {
  const Rigid3 B_from_home = geometry.B_from_UG * Rigid3::from_translation({0, 0, -geometry.gd_mm});
  const Rigid3 home_from_LG = home_from_lg(pose);
  const Rigid3 LG_from_P = inverse(geometry.P_from_LG);
  const Rigid3 home_from_P = home_from_LG * LG_from_P;
  return actuated_jacobian(geometry, B_from_home * home_from_P) *
         product_jacobian_right(B_from_home, home_from_P) * product_jacobian_left(home_from_LG, LG_from_P) *
         pose_parameters_jacobian(pose).inverse();
}

}  // namespace hexcal
