#include "tools/hexcal/report_input.h"

#include <fmt/format.h>

#include <map>

#include "kinematics/geometry/input_error.h"
#include "tools/campaign/campaign_verdict.h"
#include "tools/hexcal/network_part.h"
#include "tools/io/atomic_file.h"
#include "tools/io/calibration_record.h"
#include "tools/io/camera_file.h"
#include "tools/io/campaign_file.h"
#include "tools/io/hexapod_file.h"
#include "tools/io/measurement_id.h"
#include "tools/io/observation_table.h"
#include "tools/io/version.h"
#include "tools/report/markup.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

std::string folder_name(const fs::path& folder) {
  const fs::path absolute = fs::absolute(folder).lexically_normal();
  return (absolute.has_filename() ? absolute : absolute.parent_path()).filename().string();
}

// The first comment of a result names the command that made it, with hashes of what it read.
std::string maker_of(const fs::path& result) {
  const std::string text = read_file(result);
  const std::string line = text.substr(0, text.find('\n'));
  return line.starts_with("# ") ? line.substr(2) : "";
}

void add_compensation(const Campaign& campaign, const std::string& method, CampaignReport& report,
                      std::vector<fs::path>& inputs) {
  const fs::path results = campaign.folder / "results";
  if (!campaign.hexapod) {
    report.no_compensation =
        "Name the `hexapod` in campaign.yaml and run `hexcal compensate`: nothing is known of the machine "
        "yet.";
    return;
  }
  if (!campaign.targets && !campaign.legs) {
    report.no_compensation = "Name `targets` or `legs` in campaign.yaml and run `hexcal compensate`.";
    return;
  }
  ObservationFiles files;
  files.poses = results / "poses.csv";
  files.targets = campaign.targets;
  files.legs = campaign.legs;
  if (fs::exists(results / "poses_covariance.csv")) files.covariance = results / "poses_covariance.csv";
  for (const std::optional<fs::path>& file : {campaign.hexapod, files.legs}) {
    if (file && fs::exists(*file)) inputs.push_back(*file);
  }
  try {
    CompensationPart part;
    part.nominal = read_hexapod_file(*campaign.hexapod);
    part.observations = read_observations(part.nominal, files).observations;
    const std::string key = calibration_key(kVersion, *campaign.hexapod, files, method);
    if (auto record = read_calibration_record(results / "calibration.json", key)) {
      part.calibration = std::move(*record);
    } else {
      CalibrateOptions options;
      options.method = method;
      part.calibration = calibrate(part.nominal, part.observations, options);
      write_file_atomically(results / "calibration.json", calibration_record_text(key, part.calibration));
    }
    report.compensation = std::move(part);
  } catch (const InputError& error) {
    // The measurement is worth a report even where nothing can be identified from it.
    report.no_compensation = fmt::format("No compensation: {}", error.what());
  }
  if (fs::exists(results / "actuators.csv")) {
    inputs.push_back(results / "actuators.csv");
    report.commands = read_leg_table(results / "actuators.csv");
  }
}

// Where the machine was identified its observations hold whole covariances, else there are only sigmas.
std::map<std::string, Matrix6d> pose_covariances(const CampaignReport& report) {
  std::map<std::string, Matrix6d> out;
  for (const PoseRecord& record : report.poses) {
    if (record.sigma) out[record.id] = record.sigma->cwiseAbs2().asDiagonal();
  }
  if (!report.compensation) return out;
  const ObservationSet& observations = report.compensation->observations;
  for (std::size_t i = 0; i < observations.poses.size(); ++i)
    out[observations.poses[i].id] = observations.covariance(i);
  return out;
}

void add_network(const Campaign& campaign, CampaignReport& report) {
  const fs::path results = campaign.folder / "results";
  for (const char* file : {"photos.csv", "markers.csv", "residuals.csv", "quality.json"}) {
    if (fs::exists(results / file)) continue;
    report.no_network = fmt::format(
        "There is no `results/{}`: run `hexcal measure` again to see photographs, residuals and the 3D view.",
        file);
    return;
  }
  const PlatformGeometry* machine = report.compensation ? &report.compensation->nominal : nullptr;
  report.network = read_network_part(campaign, report, pose_covariances(report), machine);
  add_thumbnails(campaign.images, *report.network);
}

// What was decided about the campaign, as the page shows it.
Verdict shown_verdict(const Campaign& campaign, const CampaignReport& report) {
  const fs::path results = campaign.folder / "results";
  CampaignEvidence evidence;
  evidence.poses = report.poses;
  if (report.network) {
    evidence.photographs = read_photo_table(results / "photos.csv");
    evidence.quality = read_quality(results / "quality.json");
  }
  if (report.compensation) evidence.calibration = &report.compensation->calibration;
  evidence.no_compensation = report.no_compensation;
  evidence.commands = report.commands;
  const CampaignVerdict judged = judge_results(evidence);
  Verdict verdict;
  verdict.light = judged.severity == Severity::good      ? Light::good
                  : judged.severity == Severity::warning ? Light::warning
                                                         : Light::bad;
  verdict.headline = judged.headline;
  for (const Finding& finding : judged.findings) verdict.findings.push_back(sentence(finding.cause));
  for (const std::string& step : judged.next_steps) verdict.next_steps.push_back(sentence(step));
  return verdict;
}

}  // namespace

fs::path campaign_folder(const fs::path& campaign) {
  return fs::is_directory(campaign) ? campaign : campaign.parent_path();
}

CampaignReport read_campaign_report(const fs::path& path, const std::string& method) {
  const Campaign campaign = read_campaign(path);
  const fs::path results = campaign.folder / "results";
  CampaignReport report;
  report.name = folder_name(campaign.folder);
  std::vector<fs::path> inputs{campaign.file};
  if (campaign.targets && fs::exists(*campaign.targets)) {
    inputs.push_back(*campaign.targets);
    report.targets = read_pose_table(*campaign.targets);
  }
  for (const CampaignCamera& camera : campaign.cameras) {
    if (!fs::exists(camera.file)) continue;
    inputs.push_back(camera.file);
    report.cameras.push_back({camera.file.filename().string(), read_camera_file(camera.file)});
  }
  report.provenance = {{"program", fmt::format("hexcal {}", kVersion)}, {"command", "hexcal report"}};
  if (fs::exists(results / "poses.csv")) {
    inputs.push_back(results / "poses.csv");
    require_one_measurement(results / "poses.csv",
                            {results / "poses_covariance.csv", results / "photos.csv",
                             results / "markers.csv", results / "residuals.csv", results / "quality.json"});
    report.poses = read_pose_table(results / "poses.csv");
    add_compensation(campaign, method, report, inputs);
    add_network(campaign, report);
    report.provenance.emplace_back("poses.csv was made by", maker_of(results / "poses.csv"));
  }
  report.verdict = shown_verdict(campaign, report);
  for (const fs::path& input : inputs)
    report.provenance.emplace_back(input.filename().string(), "sha256 " + sha256_hex(read_file(input)));
  return report;
}

}  // namespace hexcal
