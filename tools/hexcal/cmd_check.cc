#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/nearest_name.h"
#include "tools/campaign/photograph_heads.h"
#include "tools/hexcal/commands.h"
#include "tools/hexcal/terminal.h"
#include "tools/io/hexapod_file.h"
#include "tools/io/json_text.h"
#include "tools/io/pose_table.h"

namespace hexcal {
namespace {

// Problems found on the way; a file that cannot be read at all ends the command through InputError instead.
// What was found, for people as it comes or for machines at the end.
class Findings {
 public:
  explicit Findings(bool as_json) : as_json_(as_json) {}

  void good(const std::string& line) { add("ok", "ok  ", Colour::good, line); }
  void warn(const std::string& line) {
    add("warning", "warn", Colour::warning, line);
    ++warned_;
  }
  void bad(const std::string& line) {
    add("problem", "BAD ", Colour::bad, line);
    ++bad_;
  }
  [[nodiscard]] int count() const { return bad_; }
  [[nodiscard]] std::string summary() const {
    if (bad_ > 0) return fmt::format("{} problems", bad_);
    return warned_ == 0 ? "nothing wrong found" : fmt::format("no problem, {} warnings", warned_);
  }
  [[nodiscard]] const nlohmann::ordered_json& json() const { return json_; }

  // Runs a reader whose failure is one finding among others.
  template <class Reader>
  void expect(const std::string& what, const Reader& reader) {
    try {
      good(what + ": " + reader());
    } catch (const InputError& error) {
      bad(error.what());
    }
  }

 private:
  void add(const char* severity, const char* mark, Colour colour, const std::string& line) {
    json_.push_back({{"severity", severity}, {"words", line}});
    if (!as_json_) fmt::print("{} {}\n", coloured(mark, colour), line);
  }

  bool as_json_;
  nlohmann::ordered_json json_ = nlohmann::ordered_json::array();
  int bad_ = 0;
  int warned_ = 0;
};

void check_photographs(const OpenCampaign& open, const HeadInspection& heads, Findings& findings) {
  for (const HeadFinding& finding : heads.findings) {
    const std::string line = fmt::format("{}: {}", open.listing.images[finding.image].name, finding.words);
    finding.bad ? findings.bad(line) : findings.warn(line);
  }
}

void check_poses(const OpenCampaign& open, Findings& findings) {
  std::map<std::string, int> photographs;
  for (const CampaignImage& image : open.listing.images) ++photographs[image.pose];
  for (const std::string& pose : open.listing.poses) {
    const int count = photographs[pose];
    const std::string line = fmt::format("pose {}: {} photographs", pose, count);
    if (count == 0) {
      findings.bad(line);
    } else if (count < 2) {
      findings.warn(line + ", wanted at least 2");
    } else {
      findings.good(line);
    }
  }
  for (const SkippedFile& file : open.listing.skipped)
    findings.warn(fmt::format("{}: {}", file.name, file.reason));
  const auto& lg = open.campaign.lg;
  if (!lg || lg->from != FrameRule::From::home) return;
  try {
    const std::string home = find_home(open.campaign, open.listing.poses);
    if (home != lg->home_pose) {
      findings.warn(fmt::format("home pose '{}' is none of the poses; '{}' is taken", lg->home_pose, home));
    } else if (photographs[home] == 0) {
      findings.bad(fmt::format("home pose '{}' has no photographs; poses: {}", home,
                               fmt::join(open.listing.poses, ", ")));
    }
  } catch (const InputError& error) {
    findings.bad(error.what());
  }
}

// Nominal coordinates of markers that the body has, at least three points of it.
void check_frame(const OpenCampaign& open, const char* name, const std::optional<FrameRule>& rule,
                 const MarkerSizes& markers, Findings& findings) {
  if (!rule || rule->from != FrameRule::From::nominal) return;
  std::set<MarkerPoint> known;
  std::set<int> strangers;
  for (const NominalPoint& point : rule->nominal)
    markers.count(point.point.id) != 0 ? void(known.insert(point.point))
                                       : void(strangers.insert(point.point.id));
  const std::string file = rule->nominal_file ? rule->nominal_file->string() : open.campaign.file.string();
  if (!strangers.empty()) {
    findings.warn(
        fmt::format("{}: markers {} are none of frame {}'s body", file, fmt::join(strangers, ", "), name));
  }
  if (known.size() < 3) {
    findings.bad(
        fmt::format("{}: frame {} cannot be fitted: {} points of its body's markers, wanted 3 at least", file,
                    name, known.size()));
  }
}

void check_targets(const OpenCampaign& open, const std::filesystem::path& path, Findings& findings) {
  findings.expect(path.string(), [&] {
    const std::vector<PoseRecord> targets = read_pose_table(path);
    std::set<std::string> known(open.listing.poses.begin(), open.listing.poses.end());
    std::vector<std::string> without_target;
    for (const std::string& pose : open.listing.poses) {
      if (std::ranges::find(targets, pose, &PoseRecord::id) == targets.end()) without_target.push_back(pose);
    }
    std::set<std::string> meant;
    for (const PoseRecord& target : targets) {
      if (known.count(target.id) != 0) continue;
      const auto nearest = nearest_name(target.id, without_target);
      if (nearest) meant.insert(*nearest);
      findings.warn(fmt::format("target {}: has no photographs{}", target.id,
                                nearest ? fmt::format("; did you mean {}?", *nearest) : ""));
    }
    const auto& lg = open.campaign.lg;
    for (const std::string& pose : without_target) {
      if (meant.count(pose) == 0 && !(lg && lg->home_pose == pose))
        findings.warn(fmt::format("pose {}: has no target", pose));
    }
    return fmt::format("{} targets", targets.size());
  });
}

int check(const MeasureRequest& request, bool as_json) {
  const OpenCampaign open = open_campaign(request);
  const Campaign& campaign = open.campaign;
  Findings findings(as_json);
  findings.good(fmt::format("{}: {} fixed and {} moving markers of {}", campaign.file.string(),
                            campaign.fixed.size(), campaign.moving.size(), campaign.family));
  for (std::size_t c = 0; c < open.cameras.size(); ++c) {
    const CalibratedCamera& camera = open.cameras[c];
    const std::string line = fmt::format("{}: {} x {} px, f {:.1f} px, {}", campaign.cameras[c].file.string(),
                                         camera.model.width_px, camera.model.height_px, camera.model.fy_px(),
                                         lens_model_name(camera.model.lens));
    camera.covariance.size() > 0 ? findings.good(line)
                                 : findings.warn(line + "; no covariance: sigmas of poses will be too small");
  }
  if (campaign.hexapod) {
    findings.expect(campaign.hexapod->string(), [&] {
      (void)read_hexapod_file(*campaign.hexapod);
      return std::string("a platform of six legs");
    });
  }
  if (campaign.targets) check_targets(open, *campaign.targets, findings);
  if (campaign.legs) {
    findings.expect(campaign.legs->string(),
                    [&] { return fmt::format("{} rows", read_leg_table(*campaign.legs).size()); });
  }
  check_frame(open, "UG", campaign.ug, campaign.fixed, findings);
  check_frame(open, "LG", campaign.lg, campaign.moving, findings);
  check_poses(open, findings);
  const HeadInspection heads = inspect_heads(open);
  check_photographs(open, heads, findings);
  if (as_json) {
    const nlohmann::ordered_json json{{"poses", open.listing.poses.size()},
                                      {"photographs", open.listing.images.size()},
                                      {"problems", findings.count()},
                                      {"findings", findings.json()}};
    fmt::print("{}\n", json_text(json, 1));
  } else {
    fmt::print("{} photographs in {} poses; {}\n", open.listing.images.size(), open.listing.poses.size(),
               findings.summary());
    if (findings.count() == 0) suggest_next("hexcal run " + shell_word(request.campaign.string()));
  }
  refuse_foreign_camera(open, heads);
  return findings.count() == 0 ? kDone : kSomeFailed;
}

}  // namespace

void add_check_command(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "check", "What of a campaign would be used and what is wrong with it, measuring nothing");
  command->footer(
      "Example:\n  hexcal check campaign/\n  ok   campaign.yaml: 10 fixed and 10 moving markers of tag36h11\n"
      "  BAD  p003/IMG_0007.JPG: focal length: camera 35 mm, photograph 50 mm\n"
      "Exit code 0 nothing wrong, 1 problems listed, 2 a file that cannot be read.");
  auto request = std::make_shared<MeasureRequest>();
  auto json = std::make_shared<bool>(false);
  command->add_option("campaign", request->campaign, "Campaign folder or its campaign.yaml")->required();
  command->add_option("--poses-dir", request->poses_dir, "Folder of photographs instead of the campaign's");
  command->add_flag("--json", *json, "Print what was found as JSON");
  command->callback(
      [request, json, &action] { action = [request, json] { return check(*request, *json); }; });
}

}  // namespace hexcal
