#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "tools/hexcal/campaign_measurement.h"
#include "tools/hexcal/commands.h"
#include "tools/hexcal/terminal.h"
#include "tools/io/campaign_file.h"

namespace hexcal {
namespace {

struct RunFlags {
  std::string campaign;
  std::string method;
  bool json = false;
};

// One of the other commands with its own flags, as if typed. Its JSON becomes one member of the whole.
int run_stage(void (*add)(CLI::App&, Action&), std::vector<std::string> arguments, bool json) {
  if (json) {
    fmt::print("{}\"{}\": ", arguments[0] == "measure" ? "{" : ", ", arguments[0]);
    arguments.insert(arguments.begin() + 1, "--json");
  } else {
    fmt::print("{}\n", coloured("== hexcal " + fmt::format("{}", fmt::join(arguments, " ")), Colour::bold));
  }
  std::fflush(stdout);
  CLI::App app;
  Action action;
  add(app, action);
  std::reverse(arguments.begin(), arguments.end());  // CLI11 takes them from the back
  app.parse(arguments);
  const int code = action();
  if (!json) fmt::print("\n");
  std::fflush(stdout);
  return code;
}

int run_run(const RunFlags& flags) {
  const Campaign campaign = read_campaign(flags.campaign);
  const CampaignLock lock(campaign.folder / "results");
  auto held = std::make_unique<SuggestionsHeld>();
  // As an argument of the stages; a name that begins with a dash is no flag.
  const std::string folder = flags.campaign.starts_with('-') ? "./" + flags.campaign : flags.campaign;
  int worst = run_stage(add_measure_command, {"measure", folder}, flags.json);
  if (campaign.hexapod && campaign.targets) {
    std::vector<std::string> arguments{"compensate", folder};
    if (!flags.method.empty()) arguments.insert(arguments.end(), {"--method", flags.method});
    worst = std::max(worst, run_stage(add_compensate_command, arguments, flags.json));
  } else if (!flags.json) {
    fmt::print("not compensated: campaign.yaml names no {}\n\n", campaign.hexapod ? "targets" : "hexapod");
  }
  worst = std::max(worst, run_stage(add_report_command, {"report", folder}, flags.json));
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
  command->add_flag("--json", flags->json, "print what the three commands print with --json, as one object");
  command->footer(
      "The same as: hexcal measure CAMPAIGN; hexcal compensate CAMPAIGN; hexcal report CAMPAIGN.\n"
      "Results are in CAMPAIGN/results: poses.csv, model.yaml, predicted_poses.csv, actuators.csv, "
      "report.html.");
  command->callback([flags, &action] { action = [flags] { return run_run(*flags); }; });
}

}  // namespace hexcal
