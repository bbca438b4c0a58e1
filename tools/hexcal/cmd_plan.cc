#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "calibration/plan_poses.h"
#include "kinematics/geometry/input_error.h"
#include "kinematics/sampling.h"
#include "tools/hexcal/command.h"
#include "tools/hexcal/marker_visibility.h"
#include "tools/hexcal/terminal.h"
#include "tools/io/atomic_file.h"
#include "tools/io/camera_file.h"
#include "tools/io/campaign_file.h"
#include "tools/io/hexapod_file.h"
#include "tools/io/json_text.h"
#include "tools/io/pose_table.h"
#include "tools/io/version.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

struct PlanFlags {
  fs::path campaign, hexapod, targets, candidates, load_paths, out;
  std::size_t count = 12;
  std::string criterion = "i";
  double position_sigma_mm = 0.05;
  double orientation_sigma_deg = 0.02;
  double max_tilt_deg = 60;
  std::string frames = "known";
  bool any_station = false;
  std::uint64_t seed = 1;
  bool json = false;
};

std::vector<Pose> poses_of(const fs::path& path, std::vector<std::string>* ids = nullptr) {
  std::vector<Pose> poses;
  for (const PoseRecord& record : read_pose_table(path)) {
    if (!record.pose) continue;
    poses.push_back(*record.pose);
    if (ids != nullptr) ids->push_back(record.id);
  }
  return poses;
}

// Leaves the candidates that pass, and their ids where they have any.
template <typename Condition>
void keep_if(std::vector<Pose>& candidates, std::vector<std::string>& ids, const Condition& condition) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (!condition(candidates[i])) continue;
    candidates[kept] = candidates[i];
    if (!ids.empty()) ids[kept] = ids[i];
    ++kept;
  }
  candidates.resize(kept);
  if (!ids.empty()) ids.resize(kept);
}

int run_plan(PlanFlags flags) {
  constexpr std::size_t kCandidates = 2000;
  std::optional<MeasuredNetwork> network;
  CameraModel camera;
  if (!flags.campaign.empty()) {
    const Campaign campaign = read_campaign(flags.campaign);
    const fs::path results = campaign.folder / "results";
    if (!flags.any_station && fs::exists(results / "photos.csv") && fs::exists(results / "markers.csv")) {
      network = read_measured_network(results);
      camera = read_camera_file(campaign.cameras.front().file).model;
    }
    if (flags.hexapod.empty() && campaign.hexapod) flags.hexapod = *campaign.hexapod;
    if (campaign.targets && fs::exists(*campaign.targets)) flags.targets = *campaign.targets;
  }
  if (flags.hexapod.empty())
    throw InputError("--hexapod: missing, wanted hexapod.yaml or a campaign that names it");
  const PlatformGeometry nominal = read_hexapod_file(flags.hexapod);

  std::vector<std::string> ids;
  std::vector<Pose> candidates;
  if (flags.candidates.empty()) {
    candidates = planning_candidates(nominal, kCandidates, flags.seed, flags.max_tilt_deg * kRadPerDeg);
  } else {
    candidates = poses_of(flags.candidates, &ids);
  }
  keep_if(candidates, ids,
          [&](const Pose& pose) { return tilt_rad(pose) * kDegPerRad <= flags.max_tilt_deg; });
  const std::size_t unseen_and_seen = candidates.size();
  if (network) {
    keep_if(candidates, ids,
            [&](const Pose& pose) { return can_be_measured(*network, camera, pose, nominal.gd_mm); });
    if (candidates.size() < flags.count)
      throw InputError(fmt::format(
          "{} of {} candidate poses can be measured from the stations in results/photos.csv, wanted at least "
          "{} (--any-station plans without them)",
          candidates.size(), unseen_and_seen, flags.count));
  }
  std::vector<Pose> load_paths;
  if (!flags.load_paths.empty()) {
    load_paths = poses_of(flags.load_paths);
  } else if (flags.criterion == "load") {
    SampleOptions sampling;
    sampling.count = 100;
    sampling.kind = SampleKind::load_paths;
    load_paths = sample_poses(nominal, sampling).poses;
  } else if (!flags.targets.empty()) {
    load_paths = poses_of(flags.targets);
  } else {
    SampleOptions sampling;
    sampling.count = 200;
    load_paths = sample_poses(nominal, sampling).poses;
  }
  PlanOptions options;
  options.count = flags.count;
  options.criterion = flags.criterion == "d" ? PlanCriterion::d_optimal : PlanCriterion::i_optimal;
  options.position_sigma_mm = flags.position_sigma_mm;
  options.orientation_sigma_deg = flags.orientation_sigma_deg;
  options.identify.frames_unknown = flags.frames == "unknown";
  const PosePlan plan = plan_poses(nominal, candidates, load_paths, options);

  std::vector<PoseRecord> records;
  for (std::size_t i = 0; i < plan.chosen.size(); ++i) {
    PoseRecord record;
    record.id = ids.empty() ? fmt::format("p{:02}", i + 1) : ids[plan.chosen[i]];
    record.pose = candidates[plan.chosen[i]];
    records.push_back(record);
  }
  std::vector<fs::path> inputs{flags.hexapod};
  if (!flags.candidates.empty()) inputs.push_back(flags.candidates);
  if (!flags.load_paths.empty()) inputs.push_back(flags.load_paths);
  if (!flags.targets.empty()) inputs.push_back(flags.targets);
  write_file_atomically(
      flags.out, format_pose_table(provenance_line(kVersion, "plan", inputs), records, PoseColumns::target));
  if (flags.json) {
    nlohmann::ordered_json out{{"written", flags.out.string()}, {"exchanges", plan.exchanges}};
    if (network) out["candidates_out_of_sight"] = unseen_and_seen - candidates.size();
    out["poses"] = nlohmann::ordered_json::array();
    out["predicted"] = nlohmann::ordered_json::array();
    for (const PoseRecord& record : records) out["poses"].push_back(record.id);
    for (std::size_t i = 0; i < plan.by_count.size(); ++i) {
      out["predicted"].push_back({{"poses", plan.by_count[i].poses},
                                  {"position_mm", plan.by_count[i].position_mm},
                                  {"orientation_deg", plan.by_count[i].orientation_rad * kDegPerRad},
                                  {"unplanned_position_mm", plan.random_by_count[i].position_mm}});
    }
    fmt::print("{}\n", json_text(out, 2));
    return kDone;
  }
  TextTable table({"poses", "planned_mm", "planned_deg", "unplanned_mm", "unplanned_deg"});
  for (std::size_t i = 0; i < plan.by_count.size(); ++i) {
    const PredictedError& planned = plan.by_count[i];
    const PredictedError& random = plan.random_by_count[i];
    table.add_row({std::to_string(planned.poses), fmt::format("{:.4f}", planned.position_mm),
                   fmt::format("{:.4f}", planned.orientation_rad * kDegPerRad),
                   fmt::format("{:.4f}", random.position_mm),
                   fmt::format("{:.4f}", random.orientation_rad * kDegPerRad)});
  }
  fmt::print("predicted error that remains after compensation, for poses measured to {} mm and {} deg\n{}",
             flags.position_sigma_mm, flags.orientation_sigma_deg, table.text());
  if (network)
    fmt::print("{} of {} candidates can be measured from the stations of the campaign's photographs\n",
               candidates.size(), unseen_and_seen);
  fmt::print("wrote {} poses of {} candidates to {}\n", records.size(), candidates.size(),
             flags.out.string());
  if (!flags.hexapod.empty()) {
    suggest_next(fmt::format("hexcal legs --hexapod {} --poses {} -o legs.csv",
                             shell_word(flags.hexapod.string()), shell_word(flags.out.string())));
  }
  return kDone;
}

}  // namespace

void add_plan_command(CLI::App& app, Action& action) {
  const auto flags = std::make_shared<PlanFlags>();
  CLI::App* command = app.add_subcommand("plan", "Choose the poses that identify the machine best");
  command->add_option(
      "campaign", flags->campaign,
      "campaign folder that names hexapod.yaml; once it is measured, only poses are planned whose moving "
      "markers its stations see");
  command->add_option("--hexapod", flags->hexapod, "nominal geometry (hexapod.yaml)");
  command->add_option("-n,--poses", flags->count, "number of poses")->capture_default_str();
  command
      ->add_option(
          "--criterion", flags->criterion,
          "i: least error at the --load-paths, else the campaign's targets, else over the workspace; "
          "load: along tension, compression, torsion, bending; d: best parameters")
      ->check(CLI::IsMember({"i", "load", "d"}))
      ->capture_default_str();
  command->add_option("--load-paths", flags->load_paths, "poses at which the error matters");
  command->add_option("--candidates", flags->candidates, "choose among these poses instead of the workspace");
  command
      ->add_option("--max-tilt-deg", flags->max_tilt_deg,
                   "tilt up to which the cameras see the moving markers")
      ->capture_default_str();
  command->add_flag("--any-station", flags->any_station,
                    "plan also what the stations of the measured campaign do not see");
  command->add_option("--frames", flags->frames, "known, or unknown: as compensate will be asked")
      ->check(CLI::IsMember({"known", "unknown"}))
      ->capture_default_str();
  command->add_option("--sigma-mm", flags->position_sigma_mm, "noise of measured positions")
      ->capture_default_str();
  command->add_option("--sigma-deg", flags->orientation_sigma_deg, "noise of measured angles")
      ->capture_default_str();
  command->add_option("--seed", flags->seed, "of the candidates")->capture_default_str();
  command->add_option("-o,--out", flags->out, "targets.csv to write")->required();
  command->add_flag("--json", flags->json, "machine-readable output");
  command->footer(
      "Prints the predicted remaining error against the number of poses, to know when to stop. Sample "
      "output:\n"
      "  poses  planned_mm  planned_deg  unplanned_mm  unplanned_deg\n"
      "  12         0.0412       0.0134        0.0920         0.0281");
  command->callback([flags, &action] { action = [flags] { return run_plan(*flags); }; });
}

}  // namespace hexcal
