#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "tools/campaign/campaign_lock.h"
#include "tools/campaign/measure_campaign.h"
#include "tools/campaign/measurement_record.h"
#include "tools/campaign/photograph_heads.h"
#include "tools/hexcal/campaign_commands.h"
#include "tools/hexcal/commands.h"
#include "tools/hexcal/measurement_text.h"
#include "tools/hexcal/terminal.h"
#include "tools/io/atomic_file.h"
#include "tools/io/json_text.h"
#include "tools/io/pose_table.h"
#include "tools/io/quality_file.h"

namespace hexcal {
namespace {

// Photographs counted on the terminal as they are measured.
class PhotographBar : public MeasurementObserver {
 public:
  void begin(std::size_t photographs) override { bar_.emplace("photographs", photographs); }
  void observed(const CampaignPhotograph& photograph) override {
    (void)photograph;
    bar_->advance();
  }

 private:
  std::optional<ProgressBar> bar_;
};

// What would be measured and what is wrong with the folder, as lines for people.
int list_only(const OpenCampaign& open, const HeadInspection& heads) {
  const ImageListing& listing = open.listing;
  int bad = 0;
  for (const std::string& pose : listing.poses) {
    std::string names;
    std::vector<std::string> remarks;
    int usable = 0;
    for (std::size_t i = 0; i < listing.images.size(); ++i) {
      if (listing.images[i].pose != pose) continue;
      names += ' ' + listing.images[i].path.filename().string();
      bool image_bad = false;
      for (const HeadFinding& finding : heads.findings) {
        if (finding.image != i) continue;
        image_bad = image_bad || finding.bad;
        remarks.push_back(fmt::format("{}: {}", listing.images[i].name, finding.words));
      }
      (image_bad ? bad : usable) += 1;
    }
    fmt::print("{}:{}{}\n", pose, names,
               usable == 0   ? " no photograph that counts"
               : usable == 1 ? " (one photograph only)"
                             : "");
    for (const std::string& remark : remarks) fmt::print("  {}\n", remark);
    if (usable == 0) ++bad;
  }
  for (const SkippedFile& file : listing.skipped) fmt::print("not used: {}: {}\n", file.name, file.reason);
  return bad == 0 ? kDone : kSomeFailed;
}

int list_as_json(const OpenCampaign& open, const HeadInspection& heads) {
  nlohmann::ordered_json json{{"poses", open.listing.poses},
                              {"photographs", nlohmann::ordered_json::array()},
                              {"skipped", nlohmann::ordered_json::array()}};
  for (std::size_t i = 0; i < open.listing.images.size(); ++i) {
    const CampaignImage& image = open.listing.images[i];
    nlohmann::ordered_json row{
        {"photo", image.name}, {"pose", image.pose}, {"camera", heads.camera_of_image[i]}};
    row["problems"] = nlohmann::ordered_json::array();
    row["remarks"] = nlohmann::ordered_json::array();
    for (const HeadFinding& finding : heads.findings) {
      if (finding.image == i) row[finding.bad ? "problems" : "remarks"].push_back(finding.words);
    }
    json["photographs"].push_back(row);
  }
  for (const SkippedFile& file : open.listing.skipped)
    json["skipped"].push_back({{"file", file.name}, {"reason", file.reason}});
  fmt::print("{}\n", json_text(json, 1));
  const bool any_bad =
      std::ranges::any_of(heads.findings, [](const HeadFinding& finding) { return finding.bad; });
  return any_bad ? kSomeFailed : kDone;
}

std::string next_command(const std::filesystem::path& path, const Campaign& campaign) {
  const bool machine_known = campaign.hexapod && (campaign.targets || campaign.legs);
  return fmt::format("hexcal {} {}", machine_known ? "compensate" : "report", shell_word(path.string()));
}

MeasurementAnswer measure_anew(const MeasureRequest& request, OpenCampaign open) {
  PhotographBar bar;
  const CampaignMeasurement measurement = measure_campaign(request, std::move(open), bar);
  MeasurementAnswer answer;
  answer.written = write_results(request, measurement);
  answer.text = measurement_text(measurement);
  answer.exit_code = measurement_exit_code(measurement.result);
  keep_measurement(request, measurement.open, measurement.observations, answer);
  return answer;
}

// From the files, which an unchanged measurement left as they were.
Reached reached(const std::filesystem::path& poses_csv, const std::filesystem::path& quality_json) {
  const Quality quality = read_quality(quality_json);
  Reached out;
  out.rms_px = quality.rms_px;
  out.good = quality.verdict == Severity::good;
  for (const PoseRecord& record : read_pose_table(poses_csv)) {
    if (!record.sigma) continue;
    out.mm = std::max(out.mm.value_or(0), record.sigma->head<3>().maxCoeff());
    out.deg = std::max(out.deg.value_or(0), record.sigma->tail<3>().maxCoeff() * kDegPerRad);
  }
  return out;
}

}  // namespace

int run_measure(const MeasureFlags& flags) {
  MeasureRequest request = flags.request;
  request.interior_fixed = flags.interior == "fixed";
  request.cache = !flags.no_cache;
  OpenCampaign open = open_campaign(request);
  if (flags.dry_run) {
    const HeadInspection heads = inspect_heads(open);
    const int code = flags.json ? list_as_json(open, heads) : list_only(open, heads);
    refuse_foreign_camera(open, heads);
    return code;
  }
  const std::filesystem::path quality = open.results / "quality.json";
  const std::filesystem::path poses_csv = open.poses_csv;
  const std::string next = next_command(request.campaign, open.campaign);
  const CampaignLock lock(open.results);
  std::optional<MeasurementAnswer> answer = unchanged_measurement(request, open);
  if (!answer) answer = measure_anew(request, std::move(open));
  if (flags.json) {
    fmt::print("{}", read_file(quality));
  } else {
    fmt::print("{}", answer->text);
    fmt::print("{}", written_line(answer->written));
  }
  const std::vector<std::string> passed = passed_limits(flags.limits, reached(poses_csv, quality));
  for (const std::string& line : passed) fmt::print(stderr, "limit: {}\n", line);
  if (!flags.json) suggest_next(next);
  return passed.empty() ? answer->exit_code : kSomeFailed;
}

void add_measure_command(CLI::App& app, Action& action) {
  CLI::App* command =
      app.add_subcommand("measure", "Photographs of a campaign to poses.csv, with standard deviations");
  command->footer(
      "Example:\n  hexcal measure campaign/\n"
      "  pose    x_mm    y_mm     z_mm  roll_deg  pitch_deg  yaw_deg  sigma_um  sigma_mdeg  photos  markers  "
      "rms_px  "
      "status\n"
      "  p001  1.2034  0.5521  -3.0418    0.4121    -1.2003   0.0312      0.84        0.61       3       10  "
      "0.0081  "
      "ok\n"
      "Exit code 0 done, 1 done but some poses or photographs failed (listed), 2 wrong files or flags.");
  auto flags = std::make_shared<MeasureFlags>();
  MeasureRequest& request = flags->request;
  command->add_option("campaign", request.campaign, "Campaign folder or its campaign.yaml")->required();
  command->add_option("--poses-dir", request.poses_dir,
                      "Folder with one sub-folder of photographs per pose, instead of the campaign's");
  command->add_option("-o,--output", request.output, "Where poses.csv goes (default: results/poses.csv)");
  command->add_option("--observations", request.observations,
                      "Marker observations from `hexcal detect` instead of photographs");
  command->add_option("--group-by-time", request.group_by_time_s,
                      "Flat folder: a pause of more than SECONDS between photographs begins a new pose");
  command
      ->add_option("--interior", flags->interior,
                   "Interior orientation: refine (the calibration is its prior) or fixed")
      ->check(CLI::IsMember({"refine", "fixed"}))
      ->capture_default_str();
  command
      ->add_option(
          "--map-poses", request.map_poses,
          "For thousands of poses: map the markers from this many, measure the others one by one on it "
          "(0: one adjustment of all)")
      ->check(CLI::NonNegativeNumber);
  command
      ->add_option("--threads", request.threads, "Photographs worked on at a time (default: all processors)")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--home", request.home, "This pose is the home, not the one that campaign.yaml names");
  add_limit_flags(*command, flags->limits);
  command->add_flag("--overlays", request.overlays,
                    "Write one JPEG per photograph with markers and residuals x200");
  command->add_flag("--colmap", request.colmap, "Write a COLMAP text model for its viewer");
  command->add_flag("--no-cache", flags->no_cache, "Detect again in photographs that were measured before");
  command->add_flag("--dry-run", flags->dry_run,
                    "List what would be measured and what is wrong with the folder");
  command->add_flag("--json", flags->json, "Print the result as JSON");
  command->callback([flags, &action] { action = [flags] { return run_measure(*flags); }; });
}

}  // namespace hexcal
