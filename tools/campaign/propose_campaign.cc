#include "tools/campaign/propose_campaign.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cctype>
#include <set>

#include "camera_calib/camera_report.h"
#include "camera_calib/measure_camera.h"
#include "kinematics/geometry/input_error.h"
#include "photogrammetry/photograph/sha256.h"
#include "pose_extract/marker_groups.h"
#include "tools/campaign/campaign_files.h"
#include "tools/campaign/observe_campaign.h"
#include "tools/io/atomic_file.h"
#include "tools/io/calibration_tables.h"
#include "tools/io/camera_file.h"
#include "tools/io/version.h"

namespace hexcal {
namespace fs = std::filesystem;
namespace {

constexpr double kAssumedEdgeMm = 25;  // until somebody says more: what moves shows at any scale
constexpr int kGapOfNumbers = 10;      // between the ids of two grips, where nothing else tells them apart

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

// Folders that hold photographs of all poses: those that cameras make (DCF: 100D3200) and usual names.
bool names_a_heap(const fs::path& folder) {
  static const std::set<std::string> kNames{"",       "poses",    "photos", "photographs",
                                            "images", "pictures", "dcim"};
  const std::string name = lower_case(folder.filename().string());
  const bool dcf = name.size() == 8 && std::all_of(name.begin(), name.begin() + 3,
                                                   [](unsigned char c) { return std::isdigit(c) != 0; });
  return dcf || kNames.count(name) != 0;
}

class Proposer {
 public:
  Proposer(const ProposalRequest& request, SurveyObserver& observer)
      : request_(request), observer_(observer) {}

  CampaignProposal propose() {
    out_.family = request_.family;
    out_.fixed = request_.fixed;
    out_.moving = request_.moving;
    out_.home = request_.home;
    out_.home_sure = !request_.home.empty();
    out_.marker_mm = request_.marker_mm;
    out_.sizes = request_.sizes;
    take_files(find_campaign_files(request_.folder, request_.camera, request_.sheet));
    if (fs::is_directory(request_.folder))
      survey_ = survey_photographs(request_.folder, out_.sheets, out_.family, observer_);
    for (const SkippedFile& file : survey_.skipped) remark(file.name, file.reason);
    if (survey_.photographs.empty()) return std::move(out_);
    out_.family = survey_.family;
    sort_photographs();
    make_camera();
    if (of_poses_.empty()) return std::move(out_);
    observe();
    make_poses();
    measure_scenes();
    divide_markers();
    choose_home();
    return std::move(out_);
  }

 private:
  void remark(const std::string& name, const std::string& words) {
    out_.remarks.push_back(name + ": " + words);
  }
  [[nodiscard]] std::string relative(const fs::path& path) const {
    const fs::path inside = path.lexically_proximate(request_.folder);
    return inside.empty() || *inside.begin() == ".." ? fs::absolute(path).string() : inside.generic_string();
  }

  void take_files(CampaignFiles files) {
    out_.sheets = std::move(files.sheets);
    for (const Sheet& printed : files.printed_markers) {
      if (out_.family.empty()) out_.family = printed.family;
      if (out_.marker_mm == 0) out_.marker_mm = printed.marker_mm;
      for (const int id : printed.ids)
        if (printed.marker_mm != out_.marker_mm) out_.sizes.emplace(id, printed.marker_mm);
    }
    if (!files.camera) return;
    camera_ = std::move(files.camera);
    camera_sha256_ = sha256_hex(read_file(files.camera_file));
    out_.camera = relative(files.camera_file);
    out_.camera_there = true;
  }

  void sort_photographs() {
    std::map<std::string, int> times;
    for (std::size_t i = 0; i < survey_.photographs.size(); ++i) {
      const SurveyedPhotograph& photograph = survey_.photographs[i];
      const std::string& name = photograph.image.name;
      if (!photograph.fault.empty()) {
        remark(name, photograph.fault);
      } else if (photograph.of_sheet) {
        of_sheet_.push_back(photograph.image.path);
      } else if (photograph.markers.empty()) {
        remark(name, out_.family.empty() ? "shows no marker" : "shows no marker of " + out_.family);
      } else {
        of_poses_.push_back(i);
        for (const MarkerObservation& marker : photograph.markers) ++read_times_[marker.id];
      }
    }
    out_.sheet_photographs = static_cast<int>(of_sheet_.size());
    out_.photographs = static_cast<int>(of_poses_.size());
    if (of_poses_.empty() && of_sheet_.empty()) {
      const SurveyedPhotograph& first = survey_.photographs.front();
      if (std::ranges::none_of(survey_.photographs, [](const auto& p) { return p.fault.empty(); })) {
        throw InputError(fmt::format("{}: none of its {} photographs can be read; {}: {}",
                                     request_.folder.string(), survey_.photographs.size(), first.image.name,
                                     first.fault));
      }
      throw InputError(
          fmt::format("{}: {} photographs, and none shows a marker that hexcal knows; hexcal template "
                      "markers prints some",
                      request_.folder.string(), survey_.photographs.size()));
    }
  }

  void make_camera() {
    if (camera_ || of_sheet_.empty()) return;
    observer_.begin("calibrating the camera", 2 * of_sheet_.size());
    const MeasuredCamera measured =
        measure_camera(of_sheet_, out_.sheets, {}, [this] { observer_.advance(); });
    if (measured.calibration.status != CalibrationStatus::ok) {
      remark("camera", fmt::format("not calibrated: {}", measured.calibration.reason));
      return;
    }
    const CameraReport report = report_calibration(out_.sheets, measured.photographs, measured.calibration);
    camera_ = CalibratedCamera{measured.calibration.fit.adjustment.state.camera, report.covariance,
                               measured.setting, report.quality};
    const std::string head = provenance_line(kVersion, "camera", {});
    NewCamera made;
    made.files.emplace_back("camera.yaml", format_camera_file(head, *camera_));
    made.files.emplace_back(
        "camera.inputs.csv",
        format_calibration_inputs(head, out_.sheets, measured.photographs, measured.calibration));
    camera_sha256_ = sha256_hex(made.files.front().second);
    made.verdict =
        fmt::format("{}, {:.3f} px rms", camera_verdict_name(report.quality.verdict), report.quality.rms_px);
    for (const Advice& advice : report.advice) {
      if (advice.level == AdviceLevel::retake) made.verdict += "; " + advice.words;
    }
    out_.new_camera = std::move(made);
    out_.camera = "camera.yaml";
    out_.camera_there = true;
  }

  // Measures the markers of the poses' photographs, with the camera's lens where there is one.
  void observe() {
    std::vector<int> ids;
    for (const auto& [id, times] : read_times_)
      if (times > 1 || of_poses_.size() < 4) ids.push_back(id);
    OpenCampaign open;
    open.results = request_.folder / "results";
    open.campaign.family = out_.family;
    open.campaign.cameras.push_back({request_.folder / out_.camera, "", ""});
    open.family = &marker_family(out_.family);
    open.detection.ids = ids;
    for (const int id : ids) sizes_[id] = size_of(id);
    observations_.photographs.resize(of_poses_.size());
    if (!camera_) {
      for (std::size_t k = 0; k < of_poses_.size(); ++k) {
        CampaignPhotograph& photograph = observations_.photographs[k];
        photograph.seen.markers = survey_.photographs[of_poses_[k]].markers;
        photograph.seen.info = survey_.photographs[of_poses_[k]].info;
      }
      return;
    }
    open.cameras.push_back(*camera_);
    open.camera_sha256.push_back(camera_sha256_);
    observations_.cameras = open.cameras;
    observer_.begin("measuring", of_poses_.size());
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, of_poses_.size(), 1),
        [&](const tbb::blocked_range<std::size_t>& range) {
          for (std::size_t k = range.begin(); k < range.end(); ++k) {
            tbb::this_task_arena::isolate([&] {
              observations_.photographs[k] =
                  observe_image(open, survey_.photographs[of_poses_[k]].image, true);
            });
            observer_.advance();
          }
        },
        tbb::simple_partitioner());
    for (std::size_t k = 0; k < of_poses_.size(); ++k) check_setting(k);
  }
  [[nodiscard]] double size_of(int id) const {
    const auto own = out_.sizes.find(id);
    if (own != out_.sizes.end()) return own->second;
    return out_.marker_mm > 0 ? out_.marker_mm : kAssumedEdgeMm;
  }
  [[nodiscard]] const std::string& name_of(std::size_t k) const {
    return survey_.photographs[of_poses_[k]].image.name;
  }
  void check_setting(std::size_t k) {
    const PhotographInfo& info = survey_.photographs[of_poses_[k]].info;
    const CalibratedCamera& camera = observations_.cameras.front();
    if (info.width_px != camera.model.width_px || info.height_px != camera.model.height_px) {
      remark(name_of(k), fmt::format("{} x {} px, {} is for {} x {}", info.width_px, info.height_px,
                                     out_.camera, camera.model.width_px, camera.model.height_px));
      return;
    }
    for (const SettingDifference& difference : compare_setting(camera.setting, info)) {
      if (difference.fatal) remark(name_of(k), difference.words);
    }
  }

  // Photographs of a folder are a pose, but those of a heap are split where something moved.
  void make_poses() {
    std::map<std::string, std::vector<std::size_t>, decltype(&natural_less)> folders(&natural_less);
    for (std::size_t k = 0; k < of_poses_.size(); ++k)
      folders[fs::path(name_of(k)).parent_path().generic_string()].push_back(k);
    std::vector<std::size_t> heap;
    for (const auto& [folder, photographs] : folders) {
      if (folders.size() == 1 || names_a_heap(folder)) {
        heap.insert(heap.end(), photographs.begin(), photographs.end());
        continue;
      }
      for (const std::size_t k : photographs) {
        const std::string& pose = survey_.photographs[of_poses_[k]].image.pose;
        photographs_of_[pose].push_back(k);
        observations_.photographs[k].pose = pose;
      }
    }
    if (!heap.empty()) split_heap(std::move(heap));
    for (const auto& [pose, photographs] : photographs_of_) out_.poses.push_back(pose);
    for (const std::string& pose : survey_.poses) {
      const bool empty = std::none_of(survey_.photographs.begin(), survey_.photographs.end(),
                                      [&](const auto& p) { return p.image.pose == pose; });
      if (empty) remark(pose, "a folder without photographs");
    }
    place_images();
  }

  void split_heap(std::vector<std::size_t> heap) {
    std::stable_sort(heap.begin(), heap.end(), [this](std::size_t a, std::size_t b) {
      const auto& time_a = survey_.photographs[of_poses_[a]].info.capture_time;
      const auto& time_b = survey_.photographs[of_poses_[b]].info.capture_time;
      if (time_a && time_b && *time_a != *time_b) return *time_a < *time_b;
      return natural_less(name_of(a), name_of(b));
    });
    if (!camera_) {
      for (const std::size_t k : heap) photographs_of_["g01"].push_back(k);
      return;
    }
    observer_.begin("sorting into poses", 1);
    const auto runs = split_into_poses(observations_, heap, sizes_);
    const int digits = runs.size() < 100 ? 2 : 4;
    for (std::size_t r = 0; r < runs.size(); ++r) {
      const std::string pose = fmt::format("g{:0{}d}", r + 1, digits);
      photographs_of_[pose] = runs[r];
      for (const std::size_t k : runs[r]) observations_.photographs[k].pose = pose;
      if (runs[r].size() == 1 && runs.size() > 1)
        remark(name_of(runs[r][0]), "fits no photograph before or after it: a pose of its own");
    }
    observer_.advance();
    made_table_ = true;
  }

  // The folder that holds the poses' folders and nothing else, or a table of all photographs.
  void place_images() {
    std::set<std::pair<std::string, std::string>> wanted;  // path, pose
    fs::path parent;
    for (std::size_t k = 0; k < of_poses_.size(); ++k) {
      const CampaignImage& image = survey_.photographs[of_poses_[k]].image;
      wanted.emplace(image.path.lexically_normal().string(), observations_.photographs[k].pose);
      if (k == 0) parent = fs::path(image.name).parent_path().parent_path();
    }
    if (!made_table_) {
      std::set<std::pair<std::string, std::string>> listed;
      for (const CampaignImage& image : list_images(request_.folder / parent, {}).images)
        listed.emplace(image.path.lexically_normal().string(), image.pose);
      if (std::includes(listed.begin(), listed.end(), wanted.begin(), wanted.end()) &&
          !lists_a_sheet(listed)) {
        out_.images = parent.empty() ? "." : parent.generic_string();
        return;
      }
    }
    out_.images = ".";
    for (const auto& [pose, photographs] : photographs_of_)
      for (const std::size_t k : photographs) out_.table.emplace_back(name_of(k), pose);
  }
  [[nodiscard]] bool lists_a_sheet(const std::set<std::pair<std::string, std::string>>& listed) const {
    return std::any_of(of_sheet_.begin(), of_sheet_.end(), [&](const fs::path& path) {
      const std::string name = path.lexically_normal().string();
      return std::any_of(listed.begin(), listed.end(),
                         [&](const auto& entry) { return entry.first == name; });
    });
  }

  void measure_scenes() {
    if (!camera_) return;
    observer_.begin("what moves", photographs_of_.size());
    scenes_.resize(photographs_of_.size());
    std::vector<const std::vector<std::size_t>*> lists;
    for (const auto& [pose, photographs] : photographs_of_) lists.push_back(&photographs);
    tbb::parallel_for(std::size_t{0}, lists.size(), [&](std::size_t s) {
      scenes_[s] = measure_still_scene(observations_, *lists[s], sizes_);
      observer_.advance();
    });
    for (std::size_t s = 0; s < scenes_.size(); ++s) {
      for (const std::size_t k : scenes_[s].contradicting) {
        remark(name_of(k),
               fmt::format("does not show what the other photographs of {} show: of another pose?",
                           out_.poses[s]));
      }
    }
  }

  void divide_markers() {
    if (!out_.fixed.empty() || !out_.moving.empty()) {
      out_.division = "as told";
      out_.division_sure = true;
      return;
    }
    const MarkerGroups found = group_markers(scenes_, sizes_);
    if (!found.doubt.empty()) {
      out_.division =
          fmt::format("cannot be told: {}", camera_ ? found.doubt : "there is no camera file yet");
      if (found.groups.empty() || found.poses < 2) return divide_by_number();
      for (const auto& [id, size] : sizes_) out_.fixed.push_back(id);
      return;
    }
    const std::optional<bool> above = stands_above(observations_, found.groups[0], found.groups[1]);
    const bool first_fixed = above.value_or(found.groups[0] < found.groups[1]);
    out_.fixed = found.groups[first_fixed ? 0 : 1];
    out_.moving = found.groups[first_fixed ? 1 : 0];
    out_.division_sure = above.has_value();
    out_.division = fmt::format("two groups move against each other in {} poses; {}", found.poses,
                                above ? "the upper one is taken as fixed"
                                      : "which is above the photographs do not show: the lower numbers are "
                                        "taken as fixed");
    for (std::size_t g = 2; g < found.groups.size(); ++g)
      remark(fmt::format("marker {}", fmt::join(found.groups[g], ", ")),
             "keeps its place on neither grip: left out");
    if (!found.unseen.empty())
      remark(fmt::format("marker {}", fmt::join(found.unseen, ", ")),
             "not measured in two poses beside others: left out");
  }

  void divide_by_number() {
    std::size_t cut = 0;
    int widest = kGapOfNumbers - 1;
    std::vector<int> ids;
    for (const auto& [id, size] : sizes_) ids.push_back(id);
    for (std::size_t i = 1; i < ids.size(); ++i) {
      if (ids[i] - ids[i - 1] <= widest) continue;
      widest = ids[i] - ids[i - 1];
      cut = i;
    }
    out_.fixed.assign(ids.begin(), ids.begin() + static_cast<std::ptrdiff_t>(cut == 0 ? ids.size() : cut));
    if (cut > 0) out_.moving.assign(ids.begin() + static_cast<std::ptrdiff_t>(cut), ids.end());
    out_.division += cut > 0 ? "; guessed by the gap in the numbers" : "";
  }

  void choose_home() {
    if (out_.home.empty()) {
      const auto named = std::find_if(out_.poses.begin(), out_.poses.end(),
                                      [](const std::string& pose) { return lower_case(pose) == "home"; });
      out_.home_sure = named != out_.poses.end();
      out_.home = out_.home_sure ? *named : out_.poses.front();
    }
    const auto place = std::find(out_.poses.begin(), out_.poses.end(), out_.home);
    if (place == out_.poses.end()) {
      throw InputError(fmt::format("--home: found '{}', which is none of the poses: {}", out_.home,
                                   fmt::join(out_.poses, ", ")));
    }
    if (scenes_.empty()) return;
    const StillScene& scene = scenes_[static_cast<std::size_t>(place - out_.poses.begin())];
    if (!scene.measured()) return;
    std::array<Eigen::Vector3d, 2> sums{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    std::array<int, 2> counts{0, 0};
    for (std::size_t f = 0; f < scene.network.features.size(); ++f) {
      if (!scene.adjusted.geometry.has_feature[f]) continue;
      const int id = scene.network.features[f].id;
      const bool moving = std::ranges::find(out_.moving, id) != out_.moving.end();
      if (!moving && std::ranges::find(out_.fixed, id) == out_.fixed.end()) continue;
      sums[moving ? 1 : 0] += scene.adjusted.geometry.body_from_feature[f].translation;
      ++counts[moving ? 1 : 0];
    }
    if (counts[0] == 0 || counts[1] == 0) return;
    out_.gd_edges = (sums[0] / counts[0] - sums[1] / counts[1]).norm() / size_of(out_.fixed.front());
  }

  const ProposalRequest& request_;
  SurveyObserver& observer_;
  CampaignProposal out_;
  PhotographSurvey survey_;
  std::vector<fs::path> of_sheet_;
  std::vector<std::size_t> of_poses_;  // into survey_.photographs; observations_ in this order
  std::map<int, int> read_times_;
  std::optional<CalibratedCamera> camera_;
  std::string camera_sha256_;
  MarkerSizes sizes_;
  CampaignObservations observations_;
  std::map<std::string, std::vector<std::size_t>, decltype(&natural_less)> photographs_of_{&natural_less};
  bool made_table_ = false;
  std::vector<StillScene> scenes_;  // in the order of out_.poses
};

}  // namespace

CampaignProposal propose_campaign(const ProposalRequest& request, SurveyObserver& observer) {
  tbb::task_arena arena(request.threads > 0 ? request.threads : tbb::task_arena::automatic);
  CampaignProposal proposal;
  arena.execute([&] { proposal = Proposer(request, observer).propose(); });
  return proposal;
}

}  // namespace hexcal
