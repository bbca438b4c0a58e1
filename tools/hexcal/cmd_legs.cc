#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "kinematics/dh_chain.h"
#include "kinematics/geometry/input_error.h"
#include "kinematics/inverse.h"
#include "tools/hexcal/command.h"
#include "tools/hexcal/machine_flags.h"
#include "tools/hexcal/terminal.h"
#include "tools/io/atomic_file.h"
#include "tools/io/csv_table.h"
#include "tools/io/pose_table.h"
#include "tools/io/row_stream.h"
#include "tools/io/version.h"

namespace hexcal {
namespace {

struct LegsFlags {
  MachineFlags machine;
  std::filesystem::path poses;
  std::filesystem::path out = "legs.csv";
  std::string pose;
  bool dh = false;
};

struct LegsAnswer {
  std::string status = "ok";
  std::optional<LegVector> readings;
  std::string reason;
};

// Readings are written even where the pose cannot be held, with the limit that it breaks as status: they tell
// by how much.
LegsAnswer solve(const Machine& machine, const Pose& pose) {
  const InverseResult verdict = inverse_kinematics(machine.geometry, machine.rest,
                                                   machine.geometry.B_from_P(pose), {.measure_all = false});
  LegsAnswer answer{name(verdict.verdict), verdict.readings, reason(verdict)};
  if (machine.model) {
    answer.readings = readings_for_pose(*machine.model, pose);
    if (!answer.readings) answer = {"unreachable", std::nullopt, "the model has no readings for this pose"};
  }
  return answer;
}

// Denavit-Hartenberg variables in mm and deg.
Vector6d in_degrees(Vector6d dh) {
  for (const Eigen::Index angle : {0, 1, 3, 4, 5}) dh[angle] *= kDegPerRad;
  return dh;
}

int print_dh(const Machine& machine, const Pose& pose) {
  const Matrix6d table = dh_table(machine.rest.chains, machine.geometry.B_from_P(pose));
  TextTable text({"leg", "theta1_deg", "theta2_deg", "d3_mm", "theta4_deg", "theta5_deg", "theta6_deg"});
  for (Eigen::Index leg = 0; leg < 6; ++leg) {
    std::vector<std::string> cells{std::to_string(leg + 1)};
    for (const double value : in_degrees(table.row(leg))) cells.push_back(fmt::format("{:.6f}", value));
    text.add_row(cells);
  }
  fmt::print("{}", text.text());
  return kDone;
}

int write_dh(const LegsFlags& flags, const Machine& machine) {
  std::string text = provenance_line(kVersion, "legs", {machine_file(flags.machine), flags.poses});
  text += "pose,leg,theta1_deg,theta2_deg,d3_mm,theta4_deg,theta5_deg,theta6_deg\n";
  for (const PoseRecord& record : read_pose_table(flags.poses)) {
    if (!record.pose) continue;
    const Matrix6d table = dh_table(machine.rest.chains, machine.geometry.B_from_P(*record.pose));
    for (Eigen::Index leg = 0; leg < 6; ++leg) {
      text += fmt::format("{},{}", csv_field(record.id), leg + 1);
      for (const double value : in_degrees(table.row(leg))) {
        text += ',';
        append_number(text, value, 9);
      }
      text += '\n';
    }
  }
  write_file_atomically(flags.out, text);
  return kDone;
}

int run_legs(const LegsFlags& flags) {
  if (flags.poses.empty() == flags.pose.empty())
    throw InputError("--poses, --pose: found none or both, wanted exactly one of them");
  const Machine machine = read_machine(flags.machine);
  if (flags.dh) {
    return flags.pose.empty() ? write_dh(flags, machine)
                              : print_dh(machine, pose_from_mm_deg(six_numbers(flags.pose, "--pose")));
  }
  if (!flags.pose.empty()) {
    const LegsAnswer answer = solve(machine, pose_from_mm_deg(six_numbers(flags.pose, "--pose")));
    if (answer.readings) {
      const LegVector& q = *answer.readings;
      fmt::print("{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f}\n", q[0], q[1], q[2], q[3], q[4], q[5]);
    }
    if (answer.status == "ok") return kDone;
    fmt::print(stderr, "hexcal: {}: {}\n", answer.status, answer.reason);
    return kSomeFailed;
  }
  RowTransform transform;
  transform.columns.assign(kPoseColumns.begin(), kPoseColumns.end());
  transform.header = "pose,status,q1,q2,q3,q4,q5,q6\n";
  transform.row = [&machine](const StreamedRow& row, std::string& out) {
    const LegsAnswer answer =
        solve(machine, pose_from_mm_deg(Eigen::Map<const Vector6d>(row.numbers.data())));
    out += csv_field(row.id);
    out += ',';
    out += answer.status;
    for (Eigen::Index k = 0; k < 6; ++k) {
      out += ',';
      if (answer.readings) append_number(out, (*answer.readings)[k], 9);
    }
    out += '\n';
    return answer.status == "ok";
  };
  std::string head = provenance_line(kVersion, "legs", {machine_file(flags.machine)});
  head.pop_back();
  const StreamTally tally = stream_rows(flags.poses, flags.out, head, transform, flags.machine.threads);
  if (tally.failed == 0) return kDone;
  fmt::print(stderr, "hexcal: {} of {} poses are out of reach (status in {}), the first is {}\n",
             tally.failed, tally.rows, flags.out.string(), tally.first_failed);
  return kSomeFailed;
}

}  // namespace

void add_legs_command(CLI::App& app, Action& action) {
  const auto flags = std::make_shared<LegsFlags>();
  CLI::App* command = app.add_subcommand("legs", "Actuator readings at poses (inverse kinematics)");
  flags->machine.add_to(*command);
  command->add_option("--poses", flags->poses, "pose,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg");
  command->add_option("-o,--output", flags->out, "table to write")->capture_default_str();
  command->add_option("--pose", flags->pose, "one pose, X,Y,Z,ROLL,PITCH,YAW in mm and deg, printed instead");
  command->add_flag("--dh", flags->dh,
                    "the legs' Denavit-Hartenberg variables (modified, Craig's) instead of their readings");
  command->footer(
      "Synopsis:\n"
      "  hexcal legs --hexapod hexapod.yaml --poses targets.csv -o legs.csv\n"
      "  hexcal legs --hexapod hexapod.yaml --dh --poses targets.csv -o dh.csv\n"
      "  hexcal legs --model model.yaml --pose 5,-3,2,0.5,1,-2\n"
      "Status: ok, too_short, too_long, base_joint, platform_joint, legs_collide, grips_collide, "
      "beyond_singular, "
      "near_singular.\n"
      "Sample output:\n"
      "  pose,status,q1,q2,q3,q4,q5,q6\n"
      "  p01,ok,462.113924310,455.940112218,449.070613925,460.311207006,471.514830772,468.200914551\n"
      "  p02,too_long,601.220418832,540.118230912,511.230441871,498.553301764,530.664102215,588.910342256");
  command->callback([flags, &action] { action = [flags] { return run_legs(*flags); }; });
}

}  // namespace hexcal
