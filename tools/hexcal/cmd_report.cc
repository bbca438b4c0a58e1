#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "kinematics/geometry/input_error.h"
#include "tools/hexcal/command.h"
#include "tools/hexcal/version.h"
#include "tools/io/atomic_file.h"
#include "tools/io/camera_file.h"
#include "tools/io/campaign_file.h"
#include "tools/io/hexapod_file.h"
#include "tools/io/observation_table.h"
#include "tools/report/campaign_report.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

struct ReportFlags {
  fs::path campaign, out, figures, compare;
  std::string method = "auto";
};

std::string folder_name(const fs::path& folder) {
  const fs::path absolute = fs::absolute(folder).lexically_normal();
  return (absolute.has_filename() ? absolute : absolute.parent_path()).filename().string();
}

// The same identification as `hexcal compensate` makes; it costs less than reading its result back would
// save.
void add_compensation(const Campaign& campaign, const ReportFlags& flags, CampaignReport& report,
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
  inputs.push_back(*campaign.hexapod);
  if (files.legs) inputs.push_back(*files.legs);
  if (files.covariance) inputs.push_back(*files.covariance);
  try {
    CompensationPart part;
    part.nominal = read_hexapod_file(*campaign.hexapod);
    part.observations = read_observations(part.nominal, files).observations;
    CalibrateOptions options;
    options.method = flags.method;
    part.calibration = calibrate(part.nominal, part.observations, options);
    report.compensation = std::move(part);
  } catch (const InputError& error) {
    // The measurement is worth a report even where nothing can be identified from it.
    report.no_compensation = fmt::format("No compensation: {}.", error.what());
  }
  if (fs::exists(results / "actuators.csv")) {
    inputs.push_back(results / "actuators.csv");
    report.commands = read_leg_table(results / "actuators.csv");
  }
}

CampaignReport read_report(const ReportFlags& flags) {
  const Campaign campaign = read_campaign(flags.campaign);
  const fs::path results = campaign.folder / "results";
  CampaignReport report;
  report.name = folder_name(campaign.folder);
  std::vector<fs::path> inputs{campaign.file};
  if (campaign.targets) {
    inputs.push_back(*campaign.targets);
    report.targets = read_pose_table(*campaign.targets);
  }
  if (fs::exists(results / "poses.csv")) {
    inputs.push_back(results / "poses.csv");
    report.poses = read_pose_table(results / "poses.csv");
    add_compensation(campaign, flags, report, inputs);
  }
  for (const CampaignCamera& camera : campaign.cameras) {
    if (!fs::exists(camera.file)) continue;
    inputs.push_back(camera.file);
    report.cameras.push_back({camera.file.filename().string(), read_camera_file(camera.file)});
  }
  if (!flags.compare.empty()) {
    const fs::path other =
        fs::is_directory(flags.compare) ? flags.compare / "results" / "poses.csv" : flags.compare;
    inputs.push_back(other);
    report.second_round = read_pose_table(other);
    report.second_round_name =
        fs::is_directory(flags.compare) ? folder_name(flags.compare) : other.filename().string();
  }
  report.provenance = {{"program", fmt::format("hexcal {}", kVersion)}, {"command", "hexcal report"}};
  for (const fs::path& input : inputs)
    report.provenance.emplace_back(input.filename().string(), "sha256 " + sha256_hex(read_file(input)));
  return report;
}

int run_report(const ReportFlags& flags) {
  const CampaignReport report = read_report(flags);
  const fs::path folder = fs::is_directory(flags.campaign) ? flags.campaign : flags.campaign.parent_path();
  const fs::path out = flags.out.empty() ? folder / "results" / "report.html" : flags.out;
  write_file_atomically(out, render_page(campaign_page(report)));
  const Verdict verdict = campaign_verdict(report);
  fmt::print("{}: {}\nwrote {}\n", light_words(verdict.light), verdict.headline, out.string());
  if (!flags.figures.empty()) {
    const std::vector<Chart> charts = campaign_charts(report);
    for (const Chart& chart : charts) {
      write_file_atomically(flags.figures / (chart.id + ".svg"), chart_svg_file(chart));
      write_file_atomically(flags.figures / (chart.id + ".pdf"), chart_pdf_file(chart));
    }
    fmt::print("wrote {} figures, SVG and PDF, to {}\n", charts.size(), flags.figures.string());
  }
  return kDone;
}

}  // namespace

void add_report_command(CLI::App& app, Action& action) {
  const auto flags = std::make_shared<ReportFlags>();
  CLI::App* command = app.add_subcommand("report", "Write one self-contained HTML page about a campaign");
  command->add_option("campaign", flags->campaign, "campaign folder, measured")->required();
  command->add_option("-o,--out", flags->out, "the page (default: results/report.html of the campaign)");
  command->add_option("--figures", flags->figures, "folder for every figure as SVG and PDF");
  command->add_option("--compare", flags->compare,
                      "campaign folder or poses.csv measured after compensation (same pose names)");
  command->add_option("--method", flags->method, "as for hexcal compensate")->capture_default_str();
  command->footer(
      "The page needs no network: verdict, table of poses, the paper's figures and tables for this campaign, "
      "the\n"
      "identified machine leg by leg, camera, provenance. Sample output:\n"
      "  Good: Compensation by kinematic takes the position error from 9.41 to 0.0131 mm rms (99.9 % less) "
      "...\n"
      "  wrote tiger/results/report.html");
  command->callback([flags, &action] { action = [flags] { return run_report(*flags); }; });
}

}  // namespace hexcal
