#include "calibration/calibration_model.h"

#include <array>

#include "kinematics/forward.h"

namespace hexcal {
namespace {

constexpr std::array kMethods{CompensationMethod::nominal, CompensationMethod::option1,
                              CompensationMethod::option2, CompensationMethod::option3,
                              CompensationMethod::kinematic};

}  // namespace

const char* name(CompensationMethod method) {
  switch (method) {
    case CompensationMethod::nominal:
      return "nominal";
    case CompensationMethod::option1:
      return "option1";
    case CompensationMethod::option2:
      return "option2";
    case CompensationMethod::option3:
      return "option3";
    case CompensationMethod::kinematic:
      return "kinematic";
  }
  return "";
}

std::optional<CompensationMethod> method_from_name(std::string_view text) {
  for (const CompensationMethod method : kMethods)
    if (text == name(method)) return method;
  return std::nullopt;
}

std::optional<LegVector> readings_for_pose(const CalibrationModel& model, const Pose& pose,
                                           const LegVector& approach) {
  LegVector readings;
  if (model.method == CompensationMethod::kinematic) {
    readings = machine_readings(model.machine, pose, approach);
  } else {
    const Pose command =
        model.method == CompensationMethod::nominal ? pose : predicted_pose(model.nominal, model.paper, pose);
    readings = machine_readings(MachineModel{.geometry = model.nominal}, command);
  }
  if (!readings.allFinite()) return std::nullopt;
  return readings;
}

std::optional<Pose> pose_for_readings(const CalibrationModel& model, const LegVector& readings,
                                      const LegVector& approach) {
  const bool kinematic = model.method == CompensationMethod::kinematic;
  const MachineModel machine = kinematic ? model.machine : MachineModel{.geometry = model.nominal};
  // The feasible pose of the bare geometry is the start of the one with all terms. It is searched from home,
  // which only the hexapod's own frames know: in unknown frames of a measurement the zero pose may be
  // anywhere.
  const PlatformGeometry own = kinematic ? machine_in_hexapod_frames(model).geometry : model.nominal;
  const ForwardResult feasible = forward_kinematics(own, lengths_from_readings(own, readings));
  if (feasible.status != ForwardStatus::converged) return std::nullopt;
  const auto pose =
      machine_pose(machine, readings, machine.geometry.pose_from_B_from_P(*feasible.B_from_P), approach);
  if (!pose || kinematic || model.method == CompensationMethod::nominal) return pose;
  return target_of_command(model.nominal, model.paper, *pose);
}

MachineModel machine_in_hexapod_frames(const CalibrationModel& model) {
  MachineModel machine = model.machine;
  machine.geometry.B_from_UG = model.nominal.B_from_UG;
  machine.geometry.P_from_LG = model.nominal.P_from_LG;
  return machine;
}

}  // namespace hexcal
