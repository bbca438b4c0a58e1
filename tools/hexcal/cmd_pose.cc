#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "kinematics/assembly_modes.h"
#include "kinematics/certificate.h"
#include "kinematics/forward.h"
#include "kinematics/geometry/input_error.h"
#include "tools/hexcal/command.h"
#include "tools/hexcal/machine_flags.h"
#include "tools/io/atomic_file.h"
#include "tools/io/csv_table.h"
#include "tools/io/row_stream.h"
#include "tools/io/version.h"

namespace hexcal {
namespace {

struct PoseFlags {
  MachineFlags machine;
  std::filesystem::path legs;
  std::filesystem::path out = "poses.csv";
  std::string readings;
  std::string box;
  bool certify = false;
  bool all = false;
};

struct PoseAnswer {
  std::string status = "ok";
  std::optional<Pose> pose;
  std::string reason;
};

// The feasible pose. What lies outside the limits is told with its numbers.
PoseAnswer solve(const Machine& machine, const LegVector& readings) {
  if (machine.model) {
    const std::optional<Pose> pose = pose_for_readings(*machine.model, readings);
    return pose ? PoseAnswer{"ok", pose, ""}
                : PoseAnswer{"no_pose", std::nullopt, "the model has no pose for these readings"};
  }
  const PlatformGeometry& g = machine.geometry;
  const ForwardResult forward = forward_kinematics(g, lengths_from_readings(g, readings));
  if (!forward.B_from_P) return {name(forward.status), std::nullopt, forward.reason};
  PoseAnswer answer{"ok", g.pose_from_B_from_P(*forward.B_from_P), ""};
  const InverseResult verdict =
      inverse_kinematics(g, machine.rest, *forward.B_from_P, {.measure_all = false});
  if (!verdict.reachable()) {
    answer.status = name(verdict.verdict);
    answer.reason = reason(verdict);
  }
  return answer;
}

void append_pose(std::string& out, const std::optional<Pose>& pose) {
  const Vector6d v = pose ? mm_deg_from_pose(*pose) : Vector6d(Vector6d::Zero());
  for (Eigen::Index k = 0; k < 6; ++k) {
    out += ',';
    if (pose) append_number(out, v[k], k < 3 ? 9 : 10);
  }
}

PoseBox certificate_box(const std::string& text) {
  if (text.empty()) return default_certificate_box();
  PoseBox box;
  box.upper = pose_from_mm_deg(six_numbers(text, "--box")).vector();
  if (!(box.upper.minCoeff() > 0))
    throw InputError("--box: found a number that is not positive, wanted six half widths");
  box.lower = -box.upper;
  return box;
}

void need_geometry(const Machine& machine) {
  if (machine.model)
    throw InputError("--certify, --all: work on a geometry; give --hexapod instead of --model");
}

// A row per assembly mode: pose,mode,status,...
bool append_modes(const Machine& machine, std::string_view id, const LegVector& readings, std::string& out) {
  const PlatformGeometry& g = machine.geometry;
  const AssemblyModes modes = assembly_modes(g, lengths_from_readings(g, readings));
  int number = 0;
  for (const AssemblyMode& mode : modes.modes) {
    out += fmt::format("{},{},{}", csv_field(id), ++number, name(mode.verdict));
    append_pose(out, g.pose_from_B_from_P(mode.B_from_P));
    out += fmt::format(",{:.3e},{:.3e}\n", mode.sigma_min, mode.residual_mm);
  }
  if (modes.modes.empty())
    out += fmt::format("{},0,{},,,,,,,,\n", csv_field(id), modes.complete() ? "no_pose" : "failed");
  return modes.complete() && !modes.modes.empty();
}

bool append_row(const Machine& machine, const PoseFlags& flags, const PoseBox& box, std::string_view id,
                const LegVector& readings, std::string& out, std::string& why) {
  if (flags.all) return append_modes(machine, id, readings, out);
  const PoseAnswer answer = solve(machine, readings);
  out += csv_field(id);
  out += ',';
  out += answer.status;
  append_pose(out, answer.pose);
  why = answer.reason;
  bool good = answer.status == "ok";
  if (flags.certify) {
    Certificate certificate;
    if (answer.pose)
      certificate =
          certify(machine.geometry, lengths_from_readings(machine.geometry, readings), *answer.pose, box);
    out += fmt::format(",{},{}", name(certificate.status), certificate.poses.size());
    if (good && certificate.status != CertificateStatus::unique) {
      good = false;
      why = certificate.reason.empty() ? fmt::format("{} poses in the box", certificate.poses.size())
                                       : certificate.reason;
    }
  }
  out += '\n';
  return good;
}

int run_pose(const PoseFlags& flags) {
  if (flags.legs.empty() == flags.readings.empty())
    throw InputError("--legs, --readings: found none or both, wanted exactly one of them");
  if (flags.certify && flags.all) throw InputError("--certify, --all: found both, wanted one of them");
  const Machine machine = read_machine(flags.machine);
  if (flags.certify || flags.all) need_geometry(machine);
  const PoseBox box = certificate_box(flags.box);
  RowTransform transform;
  transform.columns = {"q1", "q2", "q3", "q4", "q5", "q6"};
  const std::string numbers = "x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg";
  transform.header =
      flags.all ? "pose,mode,status," + numbers + ",sigma_min,residual_mm\n"
                : "pose,status," + numbers + (flags.certify ? ",certificate,poses_in_box" : "") + "\n";
  if (!flags.readings.empty()) {
    std::string out;
    std::string why;
    const bool good =
        append_row(machine, flags, box, "1", six_numbers(flags.readings, "--readings"), out, why);
    fmt::print("{}{}", transform.header, out);
    if (good) return kDone;
    fmt::print(stderr, "hexcal: {}\n", why.empty() ? "not every assembly mode could be found" : why);
    return kSomeFailed;
  }
  transform.row = [&](const StreamedRow& row, std::string& out) {
    std::string why;
    return append_row(machine, flags, box, row.id, Eigen::Map<const Vector6d>(row.numbers.data()), out, why);
  };
  std::string head = provenance_line(kVersion, "pose", {machine_file(flags.machine)});
  head.pop_back();
  const StreamTally tally = stream_rows(flags.legs, flags.out, head, transform, flags.machine.threads);
  if (tally.failed == 0) return kDone;
  fmt::print(stderr, "hexcal: {} of {} rows failed (status in {}), the first is {}\n", tally.failed,
             tally.rows, flags.out.string(), tally.first_failed);
  return kSomeFailed;
}

}  // namespace

void add_pose_command(CLI::App& app, Action& action) {
  const auto flags = std::make_shared<PoseFlags>();
  CLI::App* command = app.add_subcommand("pose", "Poses at actuator readings (forward kinematics)");
  flags->machine.add_to(*command);
  command->add_option("--legs", flags->legs, "pose,q1,...,q6");
  command->add_option("-o,--output", flags->out, "table to write")->capture_default_str();
  command->add_option("--readings", flags->readings, "one set Q1,...,Q6, printed instead");
  command->add_flag("--certify", flags->certify, "prove that each pose is the only one in the box");
  command->add_option(
      "--box", flags->box,
      "half widths of the certificate's box in mm and deg about home (default 150,150,150,20,20,20)");
  command->add_flag("--all", flags->all, "every real assembly mode, a row each, the feasible ones first");
  command->footer(
      "Synopsis:\n"
      "  hexcal pose --hexapod hexapod.yaml --legs legs.csv -o poses.csv\n"
      "  hexcal pose --hexapod hexapod.yaml --readings 460,455,450,460,471,468 --certify\n"
      "The pose is the one connected to home. Status: ok, a limit as in hexcal legs, or singular. The "
      "certificate is\n"
      "unique, several, none or undecided.\n"
      "Sample output:\n"
      "  pose,status,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg,certificate,poses_in_box\n"
      "  p01,ok,5.000000000,-3.000000000,2.000000000,0.5000000000,1.0000000000,-2.0000000000,unique,1");
  command->callback([flags, &action] { action = [flags] { return run_pose(*flags); }; });
}

}  // namespace hexcal
