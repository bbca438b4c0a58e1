#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>

#include "calibration/calibrate.h"
#include "kinematics/geometry/input_error.h"
#include "tools/hexcal/campaign_commands.h"
#include "tools/hexcal/command.h"
#include "tools/hexcal/compensate_report.h"
#include "tools/hexcal/terminal.h"
#include "tools/io/atomic_file.h"
#include "tools/io/calibration_record.h"
#include "tools/io/campaign_file.h"
#include "tools/io/hexapod_file.h"
#include "tools/io/measurement_id.h"
#include "tools/io/model_file.h"
#include "tools/io/observation_table.h"
#include "tools/io/pose_table.h"
#include "tools/io/version.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

std::optional<fs::path> optional_path(const fs::path& path) {
  return path.empty() ? std::nullopt : std::optional(path);
}

// Fills from the campaign what the flags leave open.
void resolve(CompensateFlags& flags) {
  if (!flags.campaign.empty()) {
    const Campaign campaign = read_campaign(flags.campaign);
    const fs::path results = campaign.folder / "results";
    refuse_linked_folders(results);
    if (flags.hexapod.empty() && campaign.hexapod) flags.hexapod = *campaign.hexapod;
    if (flags.targets.empty() && campaign.targets) flags.targets = *campaign.targets;
    if (flags.legs.empty() && campaign.legs) flags.legs = *campaign.legs;
    const fs::path covariance = results / "poses_covariance.csv";
    if (flags.poses.empty()) {
      flags.poses = results / "poses.csv";
      if (flags.covariance.empty()) require_one_measurement(flags.poses, {covariance});
    }
    // Of poses that were measured elsewhere the campaign's covariances say nothing.
    if (flags.covariance.empty() && fs::exists(covariance) &&
        !of_another_measurement(flags.poses, {covariance}))
      flags.covariance = covariance;
    if (flags.out.empty()) flags.out = results;
  }
  if (flags.out.empty()) flags.out = ".";
  if (flags.hexapod.empty())
    throw InputError("--hexapod: missing, wanted hexapod.yaml or a campaign that names it");
  if (flags.poses.empty())
    throw InputError("--poses: missing, wanted the measured poses (poses.csv) or a campaign");
}

// Round n uses the poses measured after the compensations of rounds 1 .. n - 1: OUT/round2/poses.csv was
// measured with OUT/actuators.csv, OUT/round3/poses.csv with OUT/round2/actuators.csv, and so on.
void add_later_rounds(const PlatformGeometry& nominal, const CompensateFlags& flags,
                      const ObservationDefaults& defaults, ObservationTable& table,
                      std::vector<fs::path>& inputs) {
  fs::path commanded = flags.out / "actuators.csv";
  for (int round = 2; round <= flags.round; ++round) {
    const fs::path folder = flags.out / fmt::format("round{}", round);
    ObservationFiles files{.poses = folder / "poses.csv",
                           .targets = optional_path(flags.targets),
                           .legs = commanded,
                           .covariance = std::nullopt};
    const ObservationTable later = read_observations(nominal, files, defaults);
    inputs.insert(inputs.end(), {files.poses, commanded});
    for (PoseObservation pose : later.observations.poses) {
      if (pose.is_definition) continue;
      pose.id = fmt::format("{}/round{}", pose.id, round);
      pose.target.reset();  // its readings no longer belong to a nominal command
      table.observations.poses.push_back(pose);
    }
    const auto n = static_cast<Eigen::Index>(table.observations.poses.size());
    Eigen::MatrixXd& joint = table.observations.joint_covariance;
    if (joint.size() > 0) {
      const Eigen::Index before = joint.rows();
      joint.conservativeResizeLike(Eigen::MatrixXd::Zero(6 * n, 6 * n));
      for (Eigen::Index i = before / 6; i < n; ++i)
        joint.block<6, 6>(6 * i, 6 * i) = table.observations.poses[static_cast<std::size_t>(i)].covariance;
    }
    commanded = folder / "actuators.csv";
  }
}

std::vector<Target> read_targets(const fs::path& path) {
  std::vector<Target> targets;
  for (const PoseRecord& record : read_pose_table(path))
    if (record.pose) targets.push_back({record.id, *record.pose});
  if (targets.empty()) throw InputError(fmt::format("{}: no targets", path.string()));
  return targets;
}

std::vector<fs::path> write_results(const fs::path& folder, const std::string& head,
                                    const CalibrationReport& report,
                                    const std::vector<CorrectedCommand>& commands,
                                    const LegVector& approach) {
  std::vector<PoseRecord> predicted;
  std::vector<LegRecord> actuators;
  for (const CorrectedCommand& command : commands) {
    const bool ok = command.status == CommandStatus::ok;
    const std::string status = ok ? "ok" : command.reason;
    PoseRecord pose;
    pose.id = command.id;
    pose.status = status;
    if (ok) pose.pose = command.predicted;
    pose.sigma = command.sigma;
    predicted.push_back(pose);
    actuators.push_back({command.id, status, ok ? command.readings : std::nullopt, approach});
  }
  std::vector<std::pair<fs::path, std::string>> files{
      {folder / "model.yaml", model_text(head, report.fitted.model)}};
  if (!commands.empty()) {
    files.emplace_back(folder / "predicted_poses.csv",
                       format_pose_table(head, predicted, PoseColumns::predicted));
    files.emplace_back(folder / "actuators.csv", format_leg_table(head, actuators, true));
  }
  write_files_atomically(files);
  std::vector<fs::path> written;
  for (const auto& [path, text] : files) written.push_back(path);
  return written;
}

}  // namespace

int run_compensate(CompensateFlags flags) {
  resolve(flags);
  const PlatformGeometry nominal = read_hexapod_file(flags.hexapod);
  ObservationDefaults defaults;
  defaults.frames_known = flags.frames == "known";
  defaults.with_suspect = flags.with_suspect;
  if (flags.position_sigma_mm > 0) defaults.position_sigma_mm = flags.position_sigma_mm;
  if (flags.orientation_sigma_deg > 0) defaults.orientation_sigma_deg = flags.orientation_sigma_deg;
  if (!flags.covariance.empty() && measurement_of(flags.poses) && measurement_of(flags.covariance))
    require_one_measurement(flags.poses, {flags.covariance});
  const ObservationFiles files{.poses = flags.poses,
                               .targets = optional_path(flags.targets),
                               .legs = optional_path(flags.legs),
                               .covariance = optional_path(flags.covariance)};
  const std::string key = calibration_key(kVersion, flags.hexapod, files, flags.method);
  ObservationTable table = read_observations(nominal, files, defaults);
  std::vector<fs::path> inputs{flags.hexapod, flags.targets, flags.poses, flags.legs, flags.covariance};
  if (flags.round > 1) add_later_rounds(nominal, flags, defaults, table, inputs);

  CalibrateOptions options;
  options.method = flags.method;
  options.identify.frames_unknown = flags.frames == "unknown";
  options.identify.fixed.insert(flags.fixed.begin(), flags.fixed.end());
  if (flags.tolerance_mm > 0) {
    options.identify.tolerances.joint_mm = flags.tolerance_mm;
    options.identify.tolerances.offset_mm = flags.tolerance_mm;
    options.identify.adapt_tolerances = false;
  }
  const CalibrationReport report = calibrate(nominal, table.observations, options);
  // The settings that a report of the campaign would use; others are no concern of its page.
  const bool plain = flags.round == 1 && defaults.frames_known && !flags.with_suspect &&
                     flags.fixed.empty() && flags.tolerance_mm <= 0 && !defaults.position_sigma_mm &&
                     !defaults.orientation_sigma_deg;
  const bool unchanged = key == calibration_key(kVersion, flags.hexapod, files, flags.method);
  if (plain && unchanged && !flags.campaign.empty()) {
    write_file_atomically(flags.out / "calibration.json", calibration_record_text(key, report));
  }

  std::vector<Target> targets;
  if (!flags.apply.empty() || !flags.targets.empty())
    targets = read_targets(flags.apply.empty() ? flags.targets : flags.apply);
  const LegVector approach = LegVector::Constant(flags.approach == "up"     ? 1
                                                 : flags.approach == "down" ? -1
                                                                            : 0);
  const std::vector<CorrectedCommand> commands = corrected_commands(report, targets, approach);
  const fs::path folder = flags.round > 1 ? flags.out / fmt::format("round{}", flags.round) : flags.out;
  inputs.push_back(flags.apply);
  std::erase_if(inputs, [](const fs::path& path) { return path.empty(); });
  const std::string head = provenance_line(kVersion, "compensate", inputs);
  const std::vector<fs::path> written = write_results(folder, head, report, commands, approach);
  fmt::print("{}", flags.json ? compensation_json(report, table, commands, written)
                              : compensation_text(report, table, commands, written));
  if (!flags.json && !flags.campaign.empty())
    suggest_next("hexcal report " + shell_word(flags.campaign.string()));
  const bool all_ok = !report.doubt && table.left_out.empty() &&
                      std::all_of(commands.begin(), commands.end(),
                                  [](const auto& c) { return c.status == CommandStatus::ok; });
  return all_ok ? kDone : kSomeFailed;
}

void add_compensate_command(CLI::App& app, Action& action) {
  const auto flags = std::make_shared<CompensateFlags>();
  CLI::App* command = app.add_subcommand(
      "compensate", "Identify the machine from measured poses; write the model and corrected commands");
  command->add_option("campaign", flags->campaign, "campaign folder; results/poses.csv must be measured");
  command->add_option("--hexapod", flags->hexapod, "nominal geometry (hexapod.yaml)");
  command->add_option("--targets", flags->targets, "commanded poses (targets.csv)");
  command->add_option("--poses", flags->poses, "measured poses (poses.csv)");
  command->add_option(
      "--legs", flags->legs,
      "actuator readings at the measured poses (default: nominal inverse kinematics of the targets)");
  command->add_option("--covariance", flags->covariance, "full covariance of the measured poses");
  command->add_option("--apply", flags->apply, "other targets to correct (default: the same)");
  command->add_option("-o,--out", flags->out, "folder for the results");
  command
      ->add_option(
          "--method", flags->method,
          "auto, option1, option2, option3, kinematic, geometry (kinematic without curves, sag or backlash), "
          "or a name from the printed table")
      ->capture_default_str();
  command
      ->add_option("--frames", flags->frames,
                   "known, or unknown: measured in a frame and on a target of "
                   "unknown place")
      ->check(CLI::IsMember({"known", "unknown"}))
      ->capture_default_str();
  command
      ->add_option("--round", flags->round,
                   "2: refine with OUT/round2/poses.csv, measured after compensation")
      ->check(CLI::Range(1, 99));
  command->add_option("--sigma-mm", flags->position_sigma_mm, "noise of measured positions without sigmas");
  command->add_option("--sigma-deg", flags->orientation_sigma_deg, "noise of measured angles without sigmas");
  command->add_option("--tolerance-mm", flags->tolerance_mm,
                      "trusted tolerance of joints and leg offsets (default: estimated)");
  command->add_option("--fix", flags->fixed, "parameter held at nominal, for instance 'leg 1 base x'");
  command
      ->add_option("--approach", flags->approach,
                   "up: every leg will reach its reading by growing, down: by shrinking; identified backlash "
                   "is then compensated, and actuators.csv says so")
      ->check(CLI::IsMember({"up", "down"}));
  command->add_flag("--with-suspect", flags->with_suspect,
                    "use poses of status suspect too (measured, but something contradicts them)");
  command->add_flag("--json", flags->json, "machine-readable output");
  command->footer(
      "Prints all methods by the error that would remain after compensation at poses that were not used\n"
      "(cross-validation), writes the chosen one. Sample output:\n"
      "  method        numbers  rms_mm  +-      max_mm  rms_deg  +-      max_deg  lost\n"
      "  none                0  9.4106  0.7210  17.253   3.8641  0.2811   6.912      0\n"
      "  option3            12  5.1033  0.4012   9.910   2.1107  0.1620   4.310      4\n"
      "* kinematic          48  0.0131  0.0010   0.030   0.0034  0.0003   0.007      1");
  command->callback([flags, &action] { action = [flags] { return run_compensate(*flags); }; });
}

}  // namespace hexcal
