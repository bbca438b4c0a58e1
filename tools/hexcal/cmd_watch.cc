#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "kinematics/geometry/input_error.h"
#include "tools/hexcal/campaign_measurement.h"
#include "tools/hexcal/commands.h"
#include "tools/hexcal/folder_watch.h"
#include "tools/hexcal/terminal.h"
#include "tools/io/pose_table.h"

namespace hexcal {
namespace fs = std::filesystem;
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kPollMs = 500;
constexpr int kBusyPollMs = 50;
// A file is looked at when its size rests this long. Looking too early does no harm: a part of a photograph
// does not decode, and a file that changes again is looked at again.
constexpr auto kStable = std::chrono::milliseconds(200);
constexpr auto kGiveUp = std::chrono::seconds(20);  // an undecodable file counts as bad after this long
// Poses that become complete within this time are measured together.
constexpr auto kGather = std::chrono::milliseconds(400);
constexpr auto kRename =
    std::chrono::milliseconds(1500);  // a file that vanished may turn up under another name
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
  std::string pose;
  std::uintmax_t size = 0;
  fs::file_time_type written;
  Clock::time_point changed, next_look;
  Clock::duration pause = kStable;  // doubles with every look in vain
  bool observed = false;
  PhotographObservations seen;
};

class Watcher {
 public:
  explicit Watcher(const WatchFlags& flags) : flags_(flags) {}

  int run() {
    const OpenCampaign first = reopen();
    const CampaignLock lock(first.results);
    resume(first);
    const fs::path images = flags_.request.poses_dir.value_or(first.campaign.images);
    fs::create_directories(images);
    FolderWatch watch(images);
    fmt::print("watching {} for {} photographs per pose; Ctrl-C ends\n", images.string(), flags_.expect);
    std::fflush(stdout);
    auto last_change = Clock::now();
    while (!stop_requested) {
      try {
        if (look()) last_change = Clock::now();
      } catch (const InputError& error) {
        // A folder that is away for a while, a file in the middle of being edited, a full disk: said once,
        // and tried again.
        say_once(error.what());
      }
      const std::chrono::duration<double> quiet = Clock::now() - last_change;
      if (flags_.stop_after_s > 0 && !waiting_ && quiet.count() > flags_.stop_after_s) break;
      watch.wait(due_ ? 0 : waiting_ ? kBusyPollMs : kPollMs);
    }
    for (const auto& [pose, count] : incomplete_)
      fmt::print("{} has {} of {} photographs\n", pose, count, flags_.expect);
    return kDone;
  }

 private:
  // The listing as it is now; an empty folder is no error here.
  OpenCampaign reopen() const {
    MeasureRequest request = flags_.request;
    request.allow_empty = true;
    return open_campaign(request);
  }

  // Poses that were measured before stay measured, even if a photograph was taken away since.
  void resume(const OpenCampaign& open) {
    if (!fs::exists(open.poses_csv)) return;
    try {
      for (const PoseRecord& record : read_pose_table(open.poses_csv)) complete_.insert(record.id);
    } catch (const InputError&) {
      // Not a table of ours; it will be written anew.
    }
  }

  void say_once(const std::string& words) {
    if (words == said_) return;
    said_ = words;
    fmt::print("{}\n", words);
    std::fflush(stdout);
  }

  // One look at the folder and at one photograph at most; true if there was something new.
  bool look() {
    const OpenCampaign open = reopen();
    const bool changed = scan(open);
    const std::optional<std::size_t> next = most_urgent(open);
    if (next) observe(open, *next);
    due_ = most_urgent(open).has_value();
    waiting_ = !vanished_.empty() || std::any_of(files_.begin(), files_.end(),
                                                 [](const auto& file) { return !file.second.observed; });
    if (!vanished_.empty()) return true;
    return measure_complete_poses(open) || changed || next;
  }

  // Follows sizes and times of the files; true if there is a file more or less, or one has changed.
  bool scan(const OpenCampaign& open) {
    bool news = false;
    std::map<fs::path, WatchedFile> now;
    for (const CampaignImage& image : open.listing.images) {
      std::error_code error;
      const auto size = fs::file_size(image.path, error);
      if (error) continue;  // gone again
      const auto written = fs::last_write_time(image.path, error);
      if (error) continue;
      const auto known = files_.find(image.path);
      WatchedFile file;
      if (known != files_.end()) file = known->second;
      if (known == files_.end() || file.size != size || file.written != written) {
        const auto time = Clock::now();
        file = {image.pose, size, written, time, time + kStable, kStable, false, {}};
        news = true;
      }
      file.pose = image.pose;
      file.seen.name = image.name;
      now[image.path] = std::move(file);
    }
    follow_vanished(now);
    news = news || now.size() != files_.size();
    files_ = std::move(now);
    return news;
  }

  // The photograph that is due and whose pose lacks the fewest others.
  std::optional<std::size_t> most_urgent(const OpenCampaign& open) const {
    std::map<std::string, int> lacking;
    for (const auto& [path, file] : files_) lacking[file.pose] += file.observed ? -1 : 0;
    std::optional<std::size_t> best;
    const auto time = Clock::now();
    for (std::size_t i = 0; i < open.listing.images.size(); ++i) {
      const CampaignImage& image = open.listing.images[i];
      const auto file = files_.find(image.path);
      if (file == files_.end() || file->second.observed || time < file->second.next_look) continue;
      if (!best || lacking[image.pose] < lacking[open.listing.images[*best].pose]) best = i;
    }
    return best;
  }

  void observe(const OpenCampaign& open, std::size_t image) {
    WatchedFile& file = files_.at(open.listing.images[image].path);
    const auto start = Clock::now();
    file.pause = std::min<Clock::duration>(2 * file.pause, std::chrono::seconds(2));
    file.next_look = start + file.pause;
    file.seen = observe_image(open, image, flags_.request.cache);
    // A copy in pieces may rest for a while half-written.
    file.observed = file.seen.status == PhotographStatus::ok || start - file.changed >= kGiveUp;
    file.next_look = Clock::now() + file.pause;
  }

  // Photographs of measured poses that were there a moment ago: renamed ones are found again by their
  // content, others are given up after a while.
  void follow_vanished(const std::map<fs::path, WatchedFile>& now) {
    const auto time = Clock::now();
    for (const auto& [path, file] : files_) {
      if (file.observed && complete_.count(file.pose) != 0 && now.count(path) == 0)
        vanished_[file.seen.sha256] = time;
    }
    for (const auto& [path, file] : now) {
      if (file.observed) vanished_.erase(file.seen.sha256);
    }
    std::erase_if(vanished_, [&](const auto& entry) { return time - entry.second > kRename; });
  }

  // Photographs of the pose that arrived, each content once.
  std::map<std::string, int> count_observed(const OpenCampaign& open) const {
    std::map<std::string, std::set<std::string>> contents;
    for (const CampaignImage& image : open.listing.images) {
      const auto file = files_.find(image.path);
      if (file == files_.end() || !file->second.observed) continue;
      const std::string& sha256 = file->second.seen.sha256;
      contents[image.pose].insert(sha256.empty() ? image.name : sha256);
    }
    std::map<std::string, int> counts;
    for (const auto& [pose, files] : contents) counts[pose] = static_cast<int>(files.size());
    return counts;
  }

  // Measures the campaign with the poses that are complete if that would differ from the last time; true if
  // it did.
  bool measure_complete_poses(const OpenCampaign& open) {
    incomplete_.clear();
    for (const auto& [pose, count] : count_observed(open)) {
      if (count >= flags_.expect) complete_.insert(pose);
      if (complete_.count(pose) == 0) incomplete_[pose] = count;
    }
    CampaignObservations observations;
    observations.cameras = open.cameras;
    std::string inputs;
    for (std::size_t i = 0; i < open.listing.images.size(); ++i) {
      const CampaignImage& image = open.listing.images[i];
      const auto file = files_.find(image.path);
      if (file == files_.end() || !file->second.observed || complete_.count(image.pose) == 0) continue;
      observations.photographs.push_back({image.pose, open.camera_of_image[i], file->second.seen});
      if (observations.poses.empty() || observations.poses.back() != image.pose)
        observations.poses.push_back(image.pose);
      inputs += fmt::format("{} {} {}\n", image.pose, image.name, file->second.seen.sha256);
    }
    const auto& lg = open.campaign.lg;
    const bool home_missing = lg && lg->from == FrameRule::From::home &&
                              std::find(observations.poses.begin(), observations.poses.end(),
                                        lg->home_pose) == observations.poses.end();
    if (home_missing && !observations.poses.empty())
      say_once(fmt::format("poses wait for the home pose '{}'", lg->home_pose));
    if (observations.poses.empty() || home_missing || inputs == measured_inputs_) return false;
    if (inputs != pending_inputs_) {
      if (pending_inputs_.empty()) pending_since_ = Clock::now();
      pending_inputs_ = inputs;
    }
    if (due_ && Clock::now() - pending_since_ < kGather) return false;
    pending_inputs_.clear();
    CampaignResult result = extract_poses(open.campaign, observations, extract_options(flags_.request));
    judge_against_files(open, result);
    (void)write_results(flags_.request, open, observations, result);
    measured_inputs_ = inputs;
    for (const MeasuredPose& pose : result.poses) announce(pose);
    std::fflush(stdout);
    return true;
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
  std::map<std::string, Clock::time_point> vanished_;  // by content
  std::set<std::string> complete_;                     // poses that had their photographs once
  std::map<std::string, int> incomplete_;
  std::string measured_inputs_, pending_inputs_;
  Clock::time_point pending_since_;
  std::map<std::string, std::string> announced_;
  std::string said_;
  bool waiting_ = false;  // for something that will happen soon
  bool due_ = false;      // a photograph can be looked at now
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
