#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "kinematics/geometry/input_error.h"
#include "tools/campaign/campaign_lock.h"
#include "tools/hexcal/campaign_commands.h"
#include "tools/hexcal/commands.h"
#include "tools/hexcal/terminal.h"
#include "tools/io/campaign_file.h"
#include "tools/io/json_text.h"

namespace hexcal {
namespace {

struct RunFlags {
  std::filesystem::path campaign;
  std::string method = "auto";
  std::optional<std::string> home;
  AcceptanceLimits limits;
  bool json = false;
};

// One stage under its heading; its JSON becomes one member of the whole.
template <typename Stage>
int run_stage(const char* name, const std::string& heading, bool json, const Stage& stage) {
  if (json) {
    fmt::print("{}\"{}\": ", std::string_view(name) == "measure" ? "{" : ", ", name);
  } else {
    fmt::print("{}\n", coloured("== hexcal " + heading, Colour::bold));
  }
  std::fflush(stdout);
  const int code = stage();
  if (!json) fmt::print("\n");
  std::fflush(stdout);
  return code;
}

int run_run(const RunFlags& flags) {
  const Campaign campaign = read_campaign(flags.campaign);
  const CampaignLock lock(campaign.folder / "results");
  auto held = std::make_unique<SuggestionsHeld>();
  const std::string folder = flags.campaign.string();
  MeasureFlags measure;
  measure.request.campaign = flags.campaign;
  measure.request.home = flags.home;
  measure.limits = flags.limits;
  measure.json = flags.json;
  int worst = run_stage("measure", "measure " + folder, flags.json, [&] { return run_measure(measure); });
  if (campaign.hexapod && campaign.targets) {
    CompensateFlags compensate;
    compensate.campaign = flags.campaign;
    compensate.method = flags.method;
    compensate.json = flags.json;
    const std::string heading =
        "compensate " + folder + (flags.method == "auto" ? "" : " --method " + flags.method);
    worst = std::max(worst, run_stage("compensate", heading, flags.json, [&] {
                       try {
                         return run_compensate(compensate);
                       } catch (const InputError& error) {
                         // What was measured is worth a report, which says why there is no compensation.
                         if (flags.json) {
                           fmt::print("{}", json_text(nlohmann::ordered_json{{"error", error.what()}}, 1));
                         } else {
                           fmt::print("not compensated: {}\n", error.what());
                         }
                         return static_cast<int>(kSomeFailed);
                       }
                     }));
  } else if (!flags.json) {
    fmt::print("not compensated: campaign.yaml names no {}\n\n", campaign.hexapod ? "targets" : "hexapod");
  }
  ReportFlags report;
  report.campaign = flags.campaign;
  report.require_good = flags.limits.require_good;
  report.json = flags.json;
  worst = std::max(worst,
                   run_stage("report", "report " + folder, flags.json, [&] { return run_report(report); }));
  held.reset();
  if (flags.json) {
    fmt::print("}}\n");
  } else {
    suggest_next("xdg-open " + shell_word((campaign.folder / "results" / "report.html").string()));
  }
  return worst;
}

}  // namespace

void add_run_command(CLI::App& app, Action& action) {
  const auto flags = std::make_shared<RunFlags>();
  CLI::App* command =
      app.add_subcommand("run", "Photographs in, corrected actuator commands out: the main job");
  command->add_option("campaign", flags->campaign, "campaign folder")->required();
  command->add_option("--method", flags->method, "as for compensate (default: auto)");
  command->add_option("--home", flags->home, "this pose is the home, not the one that campaign.yaml names");
  add_limit_flags(*command, flags->limits);
  command->add_flag("--json", flags->json, "print what the three commands print with --json, as one object");
  command->footer(
      "The same as: hexcal measure CAMPAIGN; hexcal compensate CAMPAIGN; hexcal report CAMPAIGN.\n"
      "Results are in CAMPAIGN/results: poses.csv, model.yaml, predicted_poses.csv, actuators.csv, "
      "report.html.");
  command->callback([flags, &action] { action = [flags] { return run_run(*flags); }; });
}

}  // namespace hexcal
