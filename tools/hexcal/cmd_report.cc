#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "tools/hexcal/campaign_commands.h"
#include "tools/hexcal/commands.h"
#include "tools/hexcal/report_input.h"
#include "tools/hexcal/terminal.h"
#include "tools/io/atomic_file.h"
#include "tools/io/json_text.h"
#include "tools/report/comparison_page.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

// A page ready to be written, of one campaign or of two.
struct PreparedPage {
  std::string html;
  Verdict verdict;
  std::vector<Chart> charts;
  std::optional<Scene3d> scene;
};

PreparedPage prepare_page(const ReportFlags& flags) {
  CampaignReport report = read_campaign_report(flags.campaign, flags.method);
  if (!flags.before.empty()) {
    const ComparisonReport both{read_campaign_report(flags.before, flags.method), std::move(report)};
    return {render_page(comparison_page(both)), comparison_verdict(both), comparison_charts(both), {}};
  }
  PreparedPage page{render_page(campaign_page(report)), report.verdict, campaign_charts(report), {}};
  if (report.network) page.scene = std::move(report.network->scene);
  return page;
}

std::vector<std::string> write_figures(const PreparedPage& page, const fs::path& folder) {
  std::vector<std::string> names;
  for (const Chart& chart : page.charts) {
    write_file_atomically(folder / (chart.id + ".svg"), chart_svg_file(chart));
    write_file_atomically(folder / (chart.id + ".pdf"), chart_pdf_file(chart));
    names.push_back(chart.id);
  }
  if (page.scene && !page.scene->poses.empty()) {
    write_file_atomically(folder / "scene.svg", scene_svg_file(*page.scene));
    write_file_atomically(folder / "scene.pdf", scene_pdf_file(*page.scene));
    names.emplace_back("scene");
  }
  return names;
}

Colour colour_of(Light light) {
  switch (light) {
    case Light::good:
      return Colour::good;
    case Light::warning:
      return Colour::warning;
    case Light::bad:
      return Colour::bad;
    case Light::none:
      break;
  }
  return Colour::plain;
}

}  // namespace

int run_report(const ReportFlags& flags) {
  refuse_linked_folders(campaign_folder(flags.campaign) / "results");
  const PreparedPage page = prepare_page(flags);
  const char* name = flags.before.empty() ? "report.html" : "comparison.html";
  const fs::path out = flags.out.empty() ? campaign_folder(flags.campaign) / "results" / name : flags.out;
  write_file_atomically(out, page.html);
  std::vector<std::string> figures;
  if (!flags.figures.empty()) figures = write_figures(page, flags.figures);
  const Verdict& verdict = page.verdict;
  const bool short_of_good = flags.require_good && verdict.light != Light::good;
  const int code = verdict.light == Light::bad || short_of_good ? kSomeFailed : kDone;
  if (flags.json) {
    const nlohmann::ordered_json json{{"verdict", light_name(verdict.light)},
                                      {"headline", verdict.headline},
                                      {"findings", verdict.findings},
                                      {"next_steps", verdict.next_steps},
                                      {"page", out.string()},
                                      {"figures", figures}};
    fmt::print("{}\n", json_text(json, 1));
    return code;
  }
  fmt::print("{}: {}\n", coloured(light_words(verdict.light), colour_of(verdict.light)), verdict.headline);
  for (const std::string& finding : verdict.findings) fmt::print("- {}\n", finding);
  for (const std::string& step : verdict.next_steps) fmt::print("next: {}\n", step);
  fmt::print("wrote {}\n", out.string());
  if (!figures.empty())
    fmt::print("wrote {} figures, SVG and PDF, to {}\n", figures.size(), flags.figures.string());
  suggest_next("xdg-open " + shell_word(out.string()));
  return code;
}

void add_report_command(CLI::App& app, Action& action) {
  const auto flags = std::make_shared<ReportFlags>();
  CLI::App* command =
      app.add_subcommand("report", "Write one self-contained HTML page about a campaign, or two compared");
  command->add_option("campaign", flags->campaign, "campaign folder, measured")->required();
  command->add_option("--before", flags->before,
                      "campaign folder of an earlier round: write a page that compares the two");
  command->add_option("-o,--out", flags->out,
                      "the page (default: results/report.html of the campaign, or results/comparison.html)");
  command->add_option("--figures", flags->figures, "folder for every figure as SVG and PDF");
  command->add_option("--method", flags->method, "as for hexcal compensate")->capture_default_str();
  command
      ->add_option_function<std::string>(
          "--require", [flags](const std::string&) { flags->require_good = true; },
          "good: exit with 1 unless the verdict is good")
      ->check(CLI::IsMember({"good"}));
  command->add_flag("--json", flags->json, "print the verdict as JSON");
  command->footer(
      "The page needs no network: verdict, table of poses, the paper's figures and tables for this campaign, "
      "the\n"
      "identified machine leg by leg, 3D view, residuals, photographs, camera, provenance. Example:\n"
      "  hexcal report tiger\n"
      "  Good: Compensation by kinematic takes the position error from 9.41 to 0.0131 mm rms (99.9 % less) "
      "...\n"
      "  wrote tiger/results/report.html\n"
      "After the corrected commands were sent and photographed as a campaign of its own:\n"
      "  hexcal report tiger-again --before tiger");
  command->callback([flags, &action] { action = [flags] { return run_report(*flags); }; });
}

}  // namespace hexcal
