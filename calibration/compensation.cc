#include "calibration/compensation.h"

#include <Eigen/LU>
#include <cmath>

#include "calibration/leg_residuals.h"
#include "calibration/normal_equations.h"
#include "kinematics/forward.h"
#include "kinematics/inverse.h"

namespace hexcal {
namespace {

// Limits of the corrected command: strokes are the actuator's own, in the lengths that its readings stand
// for, and the joints stand as in the equivalent pose of the nominal machine.
void check_limits(const PlatformGeometry& nominal, const RestState& rest, CorrectedCommand& command) {
  const InverseResult judged = inverse_kinematics(nominal, rest, nominal.B_from_P(*command.predicted));
  if (judged.reachable() || judged.verdict == PoseVerdict::near_singular) return;
  const bool stroke = judged.verdict == PoseVerdict::too_short || judged.verdict == PoseVerdict::too_long;
  command.status = stroke ? CommandStatus::out_of_stroke : CommandStatus::joint_limit;
  command.reason = reason(judged);
}

}  // namespace

Vector6d predicted_sigma(const IdentifyResult& identified, const Pose& pose, const LegVector& approach) {
  const LegLinearization legs = linearize_legs(
      identified.machine, MachineModel{.geometry = identified.machine.geometry}, identified.layout,
      identified.stroke_range, pose, machine_readings(identified.machine, pose, approach), approach);
  const ReducedPose reduced =
      reduce_to_observed(legs, {true, true, true, true, true, true}, identified.selection);
  const double leg_variance = identified.leg_sigma_mm * identified.leg_sigma_mm;
  Matrix6d leg_covariance = reduced.jacobian * identified.covariance * reduced.jacobian.transpose() +
                            leg_variance * Matrix6d::Identity();
  for (Eigen::Index k = 0; k < 6; ++k)
    if (approach[k] == 0) leg_covariance(k, k) += std::pow(identified.machine.backlash_mm[k] / 2, 2);
  if (identified.drift) {
    // The model is that of the middle of the campaign; the machine stands where it ended, or farther.
    const Vector6d moved =
        legs.jacobian.middleCols<6>(ParameterLayout::kBaseFrame) * identified.drift->motion / 2;
    leg_covariance += moved * moved.transpose();
  }
  const Matrix6d by_legs = legs.by_pose.inverse();
  return (by_legs * leg_covariance * by_legs.transpose()).diagonal().cwiseMax(0.0).cwiseSqrt();
}

std::vector<CorrectedCommand> compensate(const CalibrationModel& model, const std::vector<Target>& targets,
                                         const IdentifyResult* identified, const LegVector& approach) {
  CalibrationModel in_hexapod_frames = model;
  in_hexapod_frames.machine = machine_in_hexapod_frames(model);
  const RestState rest(model.nominal);
  std::vector<CorrectedCommand> commands;
  for (const Target& target : targets) {
    CorrectedCommand command;
    command.id = target.id;
    command.target = target.pose;
    command.readings = readings_for_pose(in_hexapod_frames, target.pose, approach);
    if (!command.readings) {
      command.reason = "the identified machine cannot take this pose";
      commands.push_back(command);
      continue;
    }
    const LegVector lengths = lengths_from_readings(model.nominal, *command.readings);
    const ForwardResult solved =
        forward_kinematics(model.nominal, lengths, model.nominal.B_from_P(target.pose));
    if (solved.status == ForwardStatus::converged && solved.residual_mm < 1e-9) {
      command.status = CommandStatus::ok;
      command.predicted = model.nominal.pose_from_B_from_P(*solved.B_from_P);
      check_limits(model.nominal, rest, command);
    } else {
      command.reason = "no pose of the nominal machine has the corrected legs";
    }
    if (identified != nullptr && model.method == CompensationMethod::kinematic) {
      // The same place of the platform, as the measurement's frames see it.
      const Pose seen = identified->machine.geometry.pose_from_B_from_P(
          in_hexapod_frames.machine.geometry.B_from_P(target.pose));
      command.sigma = predicted_sigma(*identified, seen, approach);
    }
    commands.push_back(command);
  }
  return commands;
}

}  // namespace hexcal
