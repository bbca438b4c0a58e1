#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "kinematics/geometry/input_error.h"
#include "kinematics/workspace.h"
#include "tools/hexcal/command.h"
#include "tools/hexcal/machine_flags.h"
#include "tools/hexcal/slice_picture.h"
#include "tools/io/atomic_file.h"
#include "tools/io/csv_table.h"
#include "tools/io/pose_table.h"
#include "tools/io/row_stream.h"
#include "tools/io/version.h"

namespace hexcal {
namespace {

struct WorkspaceFlags {
  MachineFlags machine;
  std::filesystem::path poses;
  std::filesystem::path out = "workspace.csv";
  std::filesystem::path svg;
  std::string slice;
  std::string at = "0,0,0,0,0,0";
  int cells = 121;
  std::string sample;
  std::size_t count = 34;
  std::uint64_t seed = 1;
  bool box = false;
  double margin_mm = 0;
  double margin_deg = 0;
};

constexpr const char* kColumns =
    "status,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg,stroke_margin_mm,joint_margin_deg,clearance_mm,"
    "singular_mm,sigma_min\n";

void append_or_empty(std::string& out, double value, int decimals) {
  out += ',';
  if (std::isfinite(value)) append_number(out, value, decimals);
}

void append_cell(std::string& out, const SliceCell& cell) {
  out += name(cell.verdict);
  const Vector6d v = mm_deg_from_pose(cell.pose);
  for (Eigen::Index k = 0; k < 6; ++k) append_or_empty(out, v[k], k < 3 ? 6 : 7);
  append_or_empty(out, cell.stroke_margin_mm, 4);
  append_or_empty(out, cell.joint_margin_rad * kDegPerRad, 4);
  append_or_empty(out, cell.clearance_mm, 4);
  append_or_empty(out, cell.singular_mm, 3);
  append_or_empty(out, cell.sigma_min, 6);
  out += '\n';
}

std::string head_of(const WorkspaceFlags& flags) {
  return provenance_line(kVersion, "workspace", {machine_file(flags.machine)});
}

PoseMargins margins_of(const WorkspaceFlags& flags) {
  PoseMargins margins;
  margins.stroke_mm = flags.margin_mm;
  margins.clearance_mm = flags.margin_mm;
  margins.joint_rad = flags.margin_deg * kRadPerDeg;
  return margins;
}

int judge_table(const WorkspaceFlags& flags, const Machine& machine) {
  RowTransform transform;
  transform.columns.assign(kPoseColumns.begin(), kPoseColumns.end());
  transform.header = std::string("pose,") + kColumns;
  transform.row = [&machine](const StreamedRow& row, std::string& out) {
    const Pose pose = pose_from_mm_deg(Eigen::Map<const Vector6d>(row.numbers.data()));
    const SliceCell cell = judge_pose(machine.geometry, machine.rest, pose);
    out += csv_field(row.id) + ",";
    append_cell(out, cell);
    return cell.verdict == PoseVerdict::reachable;
  };
  std::string head = head_of(flags);
  head.pop_back();
  const StreamTally tally = stream_rows(flags.poses, flags.out, head, transform, flags.machine.threads);
  if (tally.failed == 0) return kDone;
  fmt::print(stderr, "hexcal: {} of {} poses are not reachable (status in {}), the first is {}\n",
             tally.failed, tally.rows, flags.out.string(), tally.first_failed);
  return kSomeFailed;
}

int axis_of(const std::string& text, const WorkspaceFlags& flags) {
  const std::array<const char*, 6> names{"x", "y", "z", "roll", "pitch", "yaw"};
  for (std::size_t k = 0; k < 6; ++k) {
    if (text == names[k]) return static_cast<int>(k);
  }
  throw InputError(
      fmt::format("--slice: found '{}', wanted two of x, y, z, roll, pitch, yaw, as in x,z", flags.slice));
}

// Moves each side of the slice that has reachable cells on its rim outwards by a tenth; false when none has.
bool widen(const std::vector<SliceCell>& cells, SliceOptions& options) {
  const auto reachable = [&](int u, int v) {
    return cells[static_cast<std::size_t>(v) * static_cast<std::size_t>(options.u_count) +
                 static_cast<std::size_t>(u)]
               .verdict == PoseVerdict::reachable;
  };
  bool left = false;
  bool right = false;
  bool bottom = false;
  bool top = false;
  for (int v = 0; v < options.v_count; ++v) {
    left |= reachable(0, v);
    right |= reachable(options.u_count - 1, v);
  }
  for (int u = 0; u < options.u_count; ++u) {
    bottom |= reachable(u, 0);
    top |= reachable(u, options.v_count - 1);
  }
  const double u_rim = 0.1 * (options.u_high - options.u_low);
  const double v_rim = 0.1 * (options.v_high - options.v_low);
  const auto limit = [](int axis) { return axis < 3 ? 1e300 : (axis == 4 ? 85 : 180) * kRadPerDeg; };
  const SliceOptions before = options;
  if (left) options.u_low = std::max(options.u_low - u_rim, -limit(options.axis_u));
  if (right) options.u_high = std::min(options.u_high + u_rim, limit(options.axis_u));
  if (bottom) options.v_low = std::max(options.v_low - v_rim, -limit(options.axis_v));
  if (top) options.v_high = std::min(options.v_high + v_rim, limit(options.axis_v));
  return options.u_low < before.u_low || options.u_high > before.u_high || options.v_low < before.v_low ||
         options.v_high > before.v_high;
}

int draw_slice(const WorkspaceFlags& flags, const Machine& machine) {
  const std::size_t comma = flags.slice.find(',');
  SliceOptions options;
  options.axis_u = axis_of(flags.slice.substr(0, comma), flags);
  options.axis_v = axis_of(comma == std::string::npos ? "" : flags.slice.substr(comma + 1), flags);
  if (options.axis_u == options.axis_v) throw InputError("--slice: found one axis twice, wanted two");
  options.centre = pose_from_mm_deg(six_numbers(flags.at, "--at"));
  options.u_count = options.v_count = flags.cells;
  options.threads = flags.machine.threads;
  const PoseBox box = workspace_box(machine.geometry);
  options.u_low = box.lower[options.axis_u];
  options.u_high = box.upper[options.axis_u];
  options.v_low = box.lower[options.axis_v];
  options.v_high = box.upper[options.axis_v];
  std::vector<SliceCell> cells = workspace_slice(machine.geometry, options);
  // The box holds nearly all poses, but a slice may reach farther.
  for (int round = 0; round < 8 && widen(cells, options); ++round)
    cells = workspace_slice(machine.geometry, options);
  std::string text = head_of(flags) + kColumns;
  for (const SliceCell& cell : cells) append_cell(text, cell);
  write_file_atomically(flags.out, text);
  if (!flags.svg.empty()) write_file_atomically(flags.svg, slice_picture(cells, options));
  return kDone;
}

int print_box(const WorkspaceFlags& flags, const Machine& machine) {
  BoxOptions options;
  options.rpy_rad = pose_from_mm_deg(six_numbers(flags.at, "--at")).rpy_rad;
  options.margins = margins_of(flags);
  const ConstantOrientationBox box = largest_box(machine.geometry, options);
  if (!box.found) {
    fmt::print(stderr, "hexcal: home's position is not valid at this orientation with these margins\n");
    return kSomeFailed;
  }
  fmt::print("x_mm {:.3f} .. {:.3f}\ny_mm {:.3f} .. {:.3f}\nz_mm {:.3f} .. {:.3f}\nvolume_mm3 {:.0f}\n",
             box.lower_mm.x(), box.upper_mm.x(), box.lower_mm.y(), box.upper_mm.y(), box.lower_mm.z(),
             box.upper_mm.z(), box.volume_mm3());
  return kDone;
}

int write_sample(const WorkspaceFlags& flags, const Machine& machine) {
  SampleOptions options;
  options.count = flags.count;
  options.seed = flags.seed;
  options.margins = margins_of(flags);
  if (flags.sample == "uniform") options.kind = SampleKind::uniform;
  if (flags.sample == "halton") options.kind = SampleKind::halton;
  if (flags.sample == "load-paths") options.kind = SampleKind::load_paths;
  const SampleResult sample = sample_poses(machine.geometry, options);
  std::vector<PoseRecord> records;
  for (std::size_t i = 0; i < sample.poses.size(); ++i) {
    PoseRecord record;
    record.id = fmt::format("s{:0{}}", i + 1, fmt::formatted_size("{}", flags.count));
    record.pose = sample.poses[i];
    records.push_back(record);
  }
  write_file_atomically(flags.out, format_pose_table(head_of(flags), records, PoseColumns::target));
  if (sample.poses.size() == options.count) return kDone;
  fmt::print(stderr, "hexcal: found {} valid poses of {} after {} tries\n", sample.poses.size(),
             options.count, sample.tries);
  return kSomeFailed;
}

int run_workspace(const WorkspaceFlags& flags) {
  const int jobs = static_cast<int>(!flags.poses.empty()) + static_cast<int>(!flags.slice.empty()) +
                   static_cast<int>(!flags.sample.empty()) + static_cast<int>(flags.box);
  if (jobs != 1)
    throw InputError(
        fmt::format("--poses, --slice, --box, --sample: found {} of them, wanted exactly one", jobs));
  if (!flags.svg.empty() && flags.slice.empty()) throw InputError("--svg: goes with --slice");
  const Machine machine = read_machine(flags.machine);
  if (!flags.poses.empty()) return judge_table(flags, machine);
  if (!flags.slice.empty()) return draw_slice(flags, machine);
  if (flags.box) return print_box(flags, machine);
  return write_sample(flags, machine);
}

}  // namespace

void add_workspace_command(CLI::App& app, Action& action) {
  const auto flags = std::make_shared<WorkspaceFlags>();
  CLI::App* command =
      app.add_subcommand("workspace", "Verdicts on poses, slices and samples of the workspace");
  flags->machine.add_to(*command);
  command->add_option("--poses", flags->poses, "judge these poses (pose,x_mm,...,yaw_deg)");
  command->add_option("--slice", flags->slice,
                      "judge a grid over two of x, y, z, roll, pitch, yaw, as in x,z");
  command->add_option("--at", flags->at, "X,Y,Z,ROLL,PITCH,YAW of a slice's other parameters, or of the box")
      ->capture_default_str();
  command->add_option("--cells", flags->cells, "grid points per axis of a slice")
      ->check(CLI::Range(2, 2000))
      ->capture_default_str();
  command->add_option("--svg", flags->svg, "picture of the slice");
  command->add_flag("--box", flags->box, "print the largest box around home at one orientation");
  command->add_option("--sample", flags->sample, "write valid poses: uniform, halton or load-paths")
      ->check(CLI::IsMember({"uniform", "halton", "load-paths"}));
  command->add_option("-n,--count", flags->count, "poses of a sample")
      ->check(CLI::Range(1, 10000000))
      ->capture_default_str();
  command->add_option("--seed", flags->seed, "seed of a sample")->capture_default_str();
  command
      ->add_option("--margin-mm", flags->margin_mm,
                   "distance from strokes and other legs that samples and box keep")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command
      ->add_option("--margin-deg", flags->margin_deg, "distance from joint limits that samples and box keep")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("-o,--output", flags->out, "table to write")->capture_default_str();
  command->footer(
      "Synopsis:\n"
      "  hexcal workspace --hexapod hexapod.yaml --poses targets.csv -o verdicts.csv\n"
      "  hexcal workspace --hexapod hexapod.yaml --slice x,z --svg slice.svg -o slice.csv\n"
      "  hexcal workspace --hexapod hexapod.yaml --sample load-paths -n 34 --margin-mm 5 -o targets.csv\n"
      "  hexcal workspace --hexapod hexapod.yaml --box\n"
      "singular_mm is the distance to a singular pose to first order; sigma_min has no unit "
      "(kinematics/README.md).\n"
      "Sample output:\n"
      "  pose,status,x_mm,...,stroke_margin_mm,joint_margin_deg,clearance_mm,singular_mm,sigma_min\n"
      "  p01,ok,5.000000,...,71.2043,38.1203,,190.211,0.283104\n"
      "  p02,near_singular,0.000000,...,12.0031,4.2210,,3.914,0.011873");
  command->callback([flags, &action] { action = [flags] { return run_workspace(*flags); }; });
}

}  // namespace hexcal
