#include <fmt/format.h>

#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <map>
#include <memory>

#include "tools/campaign/watch_campaign.h"
#include "tools/hexcal/commands.h"
#include "tools/hexcal/terminal.h"

namespace hexcal {
namespace {

std::atomic<bool> stop_requested{false};

void request_stop(int) { stop_requested = true; }

class WatchLines : public WatchObserver {
 public:
  explicit WatchLines(int expect) : expect_(expect) {}

  void watching(const std::filesystem::path& images) override {
    say(fmt::format("watching {} for {} photographs per pose; Ctrl-C ends", images.string(), expect_));
  }
  void said(const std::string& words) override { say(words); }
  void measured(const CampaignMeasurement& measurement) override {
    for (const MeasuredPose& pose : measurement.result.poses) announce(pose);
    std::fflush(stdout);
  }
  void incomplete(const std::string& pose, int photographs) override {
    say(fmt::format("{} has {} of {} photographs", pose, photographs, expect_));
  }

 private:
  static void say(const std::string& words) {
    fmt::print("{}\n", words);
    std::fflush(stdout);
  }

  // One line per pose, once, and again when its verdict changes.
  void announce(const MeasuredPose& pose) {
    const std::string key = fmt::format("{} {}", static_cast<int>(pose.status), pose.images);
    if (announced_[pose.id] == key) return;
    announced_[pose.id] = key;
    if (!pose.pose) {
      fmt::print("{} {}: {}: {}\n", coloured("RED   ", Colour::bad), pose.id, pose_status_name(pose.status),
                 pose.words);
      return;
    }
    const double sigma = std::sqrt(pose.covariance.diagonal().head<3>().cwiseMax(0.0).maxCoeff());
    const double angle =
        std::sqrt(pose.covariance.diagonal().tail<3>().cwiseMax(0.0).maxCoeff()) * kDegPerRad;
    const Vector6d v = pose.pose->vector();
    fmt::print(
        "{} {}: {:.4f} {:.4f} {:.4f} mm  {:.4f} {:.4f} {:.4f} deg  sigma {:.2f} um {:.2f} mdeg  {} "
        "photos{}\n",
        pose.status != PoseStatus::ok ? coloured("RED   ", Colour::bad)
        : pose.words.empty()          ? coloured("GREEN ", Colour::good)
                                      : coloured("YELLOW", Colour::warning),
        pose.id, v[0], v[1], v[2], v[3] * kDegPerRad, v[4] * kDegPerRad, v[5] * kDegPerRad, sigma * 1e3,
        angle * 1e3, pose.images, pose.words.empty() ? "" : "  " + pose.words);
  }

  int expect_;
  std::map<std::string, std::string> announced_;  // by pose
};

int watch(const WatchRequest& request) {
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
  WatchLines lines(request.expect);
  return watch_campaign(request, stop_requested, lines) ? kDone : kSomeFailed;
}

}  // namespace

void add_watch_command(CLI::App& app, Action& action) {
  CLI::App* command =
      app.add_subcommand("watch", "Measure poses as their photographs are dropped into the folder");
  command->footer(
      "Example:\n  hexcal watch campaign/ --expect 3\n"
      "  GREEN  p001: 1.2034 0.5521 -3.0418 mm  0.4121 -1.2003 0.0312 deg  sigma 0.84 um 0.61 mdeg  3 "
      "photos\n"
      "A file counts when its size rests and it decodes. GREEN: good; YELLOW: measured, with a remark; RED: "
      "no pose, or "
      "one that something contradicts. Ctrl-C ends; the next run resumes.");
  const auto flags = std::make_shared<WatchRequest>();
  command->add_option("campaign", flags->measure.campaign, "Campaign folder or its campaign.yaml")
      ->required();
  command->add_option("--poses-dir", flags->measure.poses_dir,
                      "Folder of photographs instead of the campaign's");
  command->add_option("-o,--output", flags->measure.output,
                      "Where poses.csv goes (default: results/poses.csv)");
  command->add_option("--expect", flags->expect, "Photographs of a complete pose")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--stop-after", flags->stop_after_s, "End after SECONDS without news (default: never)")
      ->check(CLI::NonNegativeNumber);
  command->callback([flags, &action] { action = [flags] { return watch(*flags); }; });
}

}  // namespace hexcal
