#include "tools/campaign/watch_campaign.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "kinematics/geometry/input_error.h"
#include "tools/campaign/campaign_lock.h"
#include "tools/campaign/folder_watch.h"
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

// What is known of a file in the folder.
struct WatchedFile {
  CampaignPhotograph photograph;
  std::uintmax_t size = 0;
  fs::file_time_type written;
  Clock::time_point changed, next_look;
  Clock::duration pause = kStable;  // doubles with every look in vain
  bool observed = false;
};

class Watcher {
 public:
  Watcher(const WatchRequest& request, const std::atomic<bool>& stop, WatchObserver& observer)
      : request_(request), stop_(stop), observer_(observer) {}

  bool run() {
    const OpenCampaign first = reopen();
    const CampaignLock lock(first.results);
    resume(first);
    const fs::path images = request_.measure.poses_dir.value_or(first.campaign.images);
    fs::create_directories(images);
    FolderWatch watch(images);
    observer_.watching(images);
    auto last_change = Clock::now();
    while (!stop_) {
      try {
        if (look()) last_change = Clock::now();
        failing_ = false;
      } catch (const UnsuitedCamera&) {
        throw;
      } catch (const InputError& error) {
        // A folder that is away for a while, a file in the middle of being edited, a full disk: said once,
        // and tried again.
        failing_ = true;
        say_once(error.what());
      }
      const std::chrono::duration<double> quiet = Clock::now() - last_change;
      if (request_.stop_after_s > 0 && !waiting_ && quiet.count() > request_.stop_after_s) break;
      watch.wait(due_ ? 0 : waiting_ ? kBusyPollMs : kPollMs);
    }
    for (const auto& [pose, count] : incomplete_) observer_.incomplete(pose, count);
    return !failing_;
  }

 private:
  // The listing as it is now; an empty folder is no error here.
  OpenCampaign reopen() const {
    MeasureRequest request = request_.measure;
    request.allow_empty = true;
    return open_campaign(request);
  }

  // Poses that were measured before stay measured, even if a photograph was taken away since.
  void resume(const OpenCampaign& open) {
    if (!fs::exists(open.poses_csv)) return;
    try {
      for (const PoseRecord& record : read_pose_table(open.poses_csv, ReadFor::own_result))
        complete_.insert(record.id);
    } catch (const InputError&) {
      // Not a table of ours; it will be written anew.
    }
  }

  static bool has_home(const OpenCampaign& open, const std::vector<std::string>& poses) {
    try {
      (void)find_home(open.campaign, poses);
      return true;
    } catch (const InputError&) {
      return false;  // not yet
    }
  }

  void say_once(const std::string& words) {
    if (words == said_) return;
    said_ = words;
    observer_.said(words);
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
        file = {{}, size, written, time, time + kStable, kStable, false};
        news = true;
      }
      file.photograph.pose = image.pose;
      file.photograph.seen.name = image.name;
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
    for (const auto& [path, file] : files_) lacking[file.photograph.pose] += file.observed ? -1 : 0;
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
    file.photograph = observe_image(open, open.listing.images[image], request_.measure.cache);
    // A copy in pieces may rest for a while half-written.
    file.observed = file.photograph.seen.status == PhotographStatus::ok || start - file.changed >= kGiveUp;
    file.next_look = Clock::now() + file.pause;
  }

  // Photographs of measured poses that were there a moment ago: renamed ones are found again by their
  // content, others are given up after a while.
  void follow_vanished(const std::map<fs::path, WatchedFile>& now) {
    const auto time = Clock::now();
    for (const auto& [path, file] : files_) {
      if (file.observed && complete_.count(file.photograph.pose) != 0 && now.count(path) == 0)
        vanished_[file.photograph.seen.sha256] = time;
    }
    for (const auto& [path, file] : now) {
      if (file.observed) vanished_.erase(file.photograph.seen.sha256);
    }
    std::erase_if(vanished_, [&](const auto& entry) { return time - entry.second > kRename; });
  }

  // Photographs of the pose that arrived, each content once.
  std::map<std::string, int> count_observed(const OpenCampaign& open) const {
    std::map<std::string, std::set<std::string>> contents;
    for (const CampaignImage& image : open.listing.images) {
      const auto file = files_.find(image.path);
      if (file == files_.end() || !file->second.observed) continue;
      const std::string& sha256 = file->second.photograph.seen.sha256;
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
      if (count >= request_.expect) complete_.insert(pose);
      if (complete_.count(pose) == 0) incomplete_[pose] = count;
    }
    CampaignObservations observations;
    observations.cameras = open.cameras;
    std::string inputs;
    for (const CampaignImage& image : open.listing.images) {
      const auto file = files_.find(image.path);
      if (file == files_.end() || !file->second.observed || complete_.count(image.pose) == 0) continue;
      observations.photographs.push_back(file->second.photograph);
      if (observations.poses.empty() || observations.poses.back() != image.pose)
        observations.poses.push_back(image.pose);
      inputs += fmt::format("{} {} {}\n", image.pose, image.name, file->second.photograph.seen.sha256);
    }
    const auto& lg = open.campaign.lg;
    const bool home_missing = lg && lg->from == FrameRule::From::home && !has_home(open, observations.poses);
    if (home_missing && !observations.poses.empty())
      say_once(fmt::format("poses wait for the home pose '{}'", lg->home_pose));
    if (observations.poses.empty() || home_missing || inputs == measured_inputs_) return false;
    if (inputs != pending_inputs_) {
      if (pending_inputs_.empty()) pending_since_ = Clock::now();
      pending_inputs_ = inputs;
    }
    if (due_ && Clock::now() - pending_since_ < kGather) return false;
    pending_inputs_.clear();
    CampaignMeasurement measurement{open, std::move(observations), {}};
    measurement.result = measure_observations(request_.measure, open, measurement.observations);
    (void)write_results(request_.measure, measurement);
    measured_inputs_ = inputs;
    observer_.measured(measurement);
    return true;
  }

  const WatchRequest& request_;
  const std::atomic<bool>& stop_;
  WatchObserver& observer_;
  std::map<fs::path, WatchedFile> files_;
  std::map<std::string, Clock::time_point> vanished_;  // by content
  std::set<std::string> complete_;                     // poses that had their photographs once
  std::map<std::string, int> incomplete_;
  std::string measured_inputs_, pending_inputs_;
  Clock::time_point pending_since_;
  std::string said_;
  bool waiting_ = false;  // for something that will happen soon
  bool failing_ = false;  // the last look met a fault in the files
  bool due_ = false;      // a photograph can be looked at now
};

}  // namespace

bool watch_campaign(const WatchRequest& request, const std::atomic<bool>& stop, WatchObserver& observer) {
  return Watcher(request, stop, observer).run();
}

}  // namespace hexcal
