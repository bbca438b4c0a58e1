#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <map>
#include <memory>
#include <set>

#include "kinematics/geometry/input_error.h"
#include "tools/hexcal/campaign_measurement.h"
#include "tools/hexcal/commands.h"
#include "tools/hexcal/folder_watch.h"
#include "tools/hexcal/terminal.h"

namespace hexcal {
namespace fs = std::filesystem;
namespace {

constexpr int kPollMs = 500;
constexpr auto kStable = std::chrono::milliseconds(400);  // a file is complete when its size rests this long
constexpr auto kGiveUp = std::chrono::seconds(20);  // and undecodable files count as bad after this long
constexpr double kGoodSigmaMm = 0.01;
constexpr double kPoorSigmaMm = 0.05;

std::atomic<bool> stop_requested{false};

void request_stop(int) { stop_requested = true; }

struct WatchFlags {
  MeasureRequest request;
  int expect = 3;
  double stop_after_s = 0;  // of quiet; 0: never
};

// What is known of a file in the folder.
struct WatchedFile {
  std::uintmax_t size = 0;
  fs::file_time_type written;
  std::chrono::steady_clock::time_point changed;
  bool observed = false;
  PhotographObservations seen;
};

class Watcher {
 public:
  explicit Watcher(const WatchFlags& flags) : flags_(flags) {}

  int run() {
    OpenCampaign first = reopen();
    const CampaignLock lock(first.results);
    const fs::path images = flags_.request.poses_dir.value_or(first.campaign.images);
    fs::create_directories(images);
    FolderWatch watch(images);
    fmt::print("watching {} for {} photographs per pose; Ctrl-C ends\n", images.string(), flags_.expect);
    std::fflush(stdout);
    auto last_change = std::chrono::steady_clock::now();
    while (!stop_requested) {
      OpenCampaign open = reopen();
      const bool news = observe_complete_files(open);
      if (news || removed_) {
        measure_ready_poses(open);
        last_change = std::chrono::steady_clock::now();
      }
      const std::chrono::duration<double> quiet = std::chrono::steady_clock::now() - last_change;
      if (flags_.stop_after_s > 0 && quiet.count() > flags_.stop_after_s) break;
      watch.wait(waiting_ ? 100 : kPollMs);
    }
    return kDone;
  }

 private:
  // The listing as it is now; an empty folder is no error here.
  OpenCampaign reopen() const {
    MeasureRequest request = flags_.request;
    request.allow_empty = true;
    return open_campaign(request);
  }

  // Looks at every file; observes those that are complete. True if a photograph was added.
  bool observe_complete_files(const OpenCampaign& open) {
    bool news = false;
    waiting_ = false;
    std::map<fs::path, WatchedFile> now;
    for (std::size_t i = 0; i < open.listing.images.size() && !stop_requested; ++i) {
      const fs::path& path = open.listing.images[i].path;
      std::error_code error;
      const auto size = fs::file_size(path, error);
      const auto written = fs::last_write_time(path, error);
      if (error) continue;  // gone again
      const auto time = std::chrono::steady_clock::now();
      WatchedFile file;
      const auto known = files_.find(path);
      if (known != files_.end()) file = known->second;
      if (known == files_.end() || file.size != size || file.written != written) {
        file = {size, written, time, false, {}};
      }
      if (!file.observed) {
        if (size > 0 && time - file.changed >= kStable) {
          file.seen = observe_image(open, i, flags_.request.cache);
          const bool good = file.seen.status == PhotographStatus::ok;
          // A copy in pieces may rest for a while half-written.
          file.observed = good || time - file.changed >= kGiveUp;
          news = news || file.observed;
        }
        waiting_ = waiting_ || !file.observed;
      }
      file.seen.name = open.listing.images[i].name;
      now[path] = std::move(file);
    }
    removed_ = false;
    for (const auto& [path, file] : files_) removed_ = removed_ || (file.observed && now.count(path) == 0);
    files_ = std::move(now);
    return news;
  }

  // Measures the campaign with the poses that are complete, and says what is new.
  void measure_ready_poses(const OpenCampaign& open) {
    std::map<std::string, int> observed;
    for (const CampaignImage& image : open.listing.images) {
      const auto file = files_.find(image.path);
      if (file != files_.end() && file->second.observed) ++observed[image.pose];
    }
    CampaignObservations observations;
    observations.cameras = open.cameras;
    for (const std::string& pose : open.listing.poses) {
      if (observed[pose] >= flags_.expect) observations.poses.push_back(pose);
    }
    for (std::size_t i = 0; i < open.listing.images.size(); ++i) {
      const CampaignImage& image = open.listing.images[i];
      const auto file = files_.find(image.path);
      if (file == files_.end() || !file->second.observed || observed[image.pose] < flags_.expect) continue;
      observations.photographs.push_back({image.pose, open.camera_of_image[i], file->second.seen});
    }
    const auto& lg = open.campaign.lg;
    const bool home_missing =
        lg && lg->from == FrameRule::From::home && observed[lg->home_pose] < flags_.expect;
    if (observations.poses.empty() || home_missing) {
      if (home_missing && !observations.poses.empty() && !said_home_) {
        fmt::print("poses wait for the home pose '{}'\n", lg->home_pose);
        std::fflush(stdout);
        said_home_ = true;
      }
      return;
    }
    const CampaignResult result = extract_poses(open.campaign, observations, extract_options(flags_.request));
    (void)write_results(flags_.request, open, observations, result);
    for (const MeasuredPose& pose : result.poses) announce(pose);
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
    const bool good = sigma <= kGoodSigmaMm && pose.words.empty();
    const Vector6d v = pose.pose->vector();
    fmt::print(
        "{} {}: {:.4f} {:.4f} {:.4f} mm  {:.4f} {:.4f} {:.4f} deg  sigma {:.2f} um {:.2f} mdeg  {} "
        "photos{}\n",
        good                    ? coloured("GREEN ", Colour::good)
        : sigma <= kPoorSigmaMm ? coloured("YELLOW", Colour::warning)
                                : coloured("RED   ", Colour::bad),
        pose.id, v[0], v[1], v[2], v[3] * kDegPerRad, v[4] * kDegPerRad, v[5] * kDegPerRad, sigma * 1e3,
        angle * 1e3, pose.images, pose.words.empty() ? "" : "  " + pose.words);
  }

  const WatchFlags& flags_;
  std::map<fs::path, WatchedFile> files_;
  std::map<std::string, std::string> announced_;
  bool waiting_ = false;
  bool removed_ = false;
  bool said_home_ = false;
};

int watch(const WatchFlags& flags) {
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
  return Watcher(flags).run();
}

}  // namespace

void add_watch_command(CLI::App& app, Action& action) {
  CLI::App* command =
      app.add_subcommand("watch", "Measure poses as their photographs are dropped into the folder");
  command->footer(
      "Example:\n  hexcal watch campaign/ --expect 3\n"
      "  GREEN  p001: 1.2034 0.5521 -3.0418 mm  0.4121 -1.2003 0.0312 deg  sigma 0.84 um 0.61 mdeg  3 "
      "photos\n"
      "A file counts when its size rests and it decodes. GREEN: sigma at most 10 um and nothing to remark; "
      "YELLOW: at "
      "most 50 um; RED: no pose, or a poor one. Ctrl-C ends; the next run resumes.");
  auto flags = std::make_shared<WatchFlags>();
  command->add_option("campaign", flags->request.campaign, "Campaign folder or its campaign.yaml")
      ->required();
  command->add_option("--poses-dir", flags->request.poses_dir,
                      "Folder of photographs instead of the campaign's");
  command->add_option("-o,--output", flags->request.output,
                      "Where poses.csv goes (default: results/poses.csv)");
  command->add_option("--expect", flags->expect, "Photographs of a complete pose")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--stop-after", flags->stop_after_s, "End after SECONDS without news (default: never)")
      ->check(CLI::NonNegativeNumber);
  command->callback([flags, &action] { action = [flags] { return watch(*flags); }; });
}

}  // namespace hexcal
