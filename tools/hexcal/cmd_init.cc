#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <set>

#include "kinematics/geometry/input_error.h"
#include "tools/campaign/align_campaign.h"
#include "tools/campaign/propose_campaign.h"
#include "tools/hexcal/commands.h"
#include "tools/hexcal/init_files.h"
#include "tools/hexcal/questions.h"
#include "tools/hexcal/terminal.h"
#include "tools/io/atomic_file.h"
#include "tools/io/campaign_file.h"
#include "tools/io/campaign_text.h"
#include "tools/io/hexapod_file.h"
#include "tools/io/scalar_text.h"
#include "tools/io/symmetric_hexapod.h"
#include "tools/io/version.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostRemarks = 8;
constexpr double kLongestMm = 1e5;

struct InitFlags {
  fs::path folder;
  std::string marker_mm, family, fixed, moving, home, machine, joints, leg_mm;
  std::optional<fs::path> camera, sheet;
  std::optional<double> gd_mm;
  bool yes = false;
};

std::vector<int> ids_of_flag(const std::string& text, const char* flag) {
  std::vector<int> ids;
  for (std::string_view rest = text; !rest.empty();) {
    const std::size_t comma = std::min(rest.find(','), rest.size());
    const auto range = id_range_from_text(trimmed(rest.substr(0, comma)));
    rest.remove_prefix(std::min(comma + 1, rest.size()));
    if (!range)
      throw InputError(fmt::format("{}: found '{}', wanted ids and ranges such as 0-9,12", flag, text));
    for (int id = range->first; id <= range->last; ++id) ids.push_back(id);
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

// `24`, or `24,100-109:12` where some markers differ.
void read_sizes_flag(const std::string& text, ProposalRequest& request) {
  for (std::string_view rest = text; !rest.empty();) {
    const std::size_t comma = std::min(rest.find(','), rest.size());
    const std::string_view part = trimmed(rest.substr(0, comma));
    rest.remove_prefix(std::min(comma + 1, rest.size()));
    const std::size_t colon = part.find(':');
    const auto size = number_from_text(colon == std::string_view::npos ? part : part.substr(colon + 1));
    const bool of_ids = colon != std::string_view::npos;
    const IdRange none{0, -1};
    const IdRange range = of_ids ? id_range_from_text(part.substr(0, colon)).value_or(none) : none;
    if (!size || !(*size > 0) || (of_ids && range.last < range.first)) {
      throw InputError(fmt::format(
          "--marker-mm: found '{}', wanted the edge of the black square as in 24 or 24,100-109:12", text));
    }
    if (!of_ids) request.marker_mm = *size;
    for (int id = range.first; id <= range.last; ++id) request.sizes[id] = *size;
  }
}

class BarObserver : public SurveyObserver {
 public:
  void begin(const std::string& words, std::size_t count) override {
    bar_.reset();
    bar_ = std::make_unique<ProgressBar>(words, count);
  }
  void advance() override { bar_->advance(); }
  void end() { bar_.reset(); }

 private:
  std::unique_ptr<ProgressBar> bar_;
};

// Files that are written together at the end; those that are there already stay.
class NewFiles {
 public:
  explicit NewFiles(fs::path folder) : folder_(std::move(folder)) {}
  [[nodiscard]] bool there(const std::string& name) const { return fs::exists(folder_ / name); }
  void add(const std::string& name, std::string text) {
    if (there(name)) {
      kept_.push_back(name);
    } else {
      files_.emplace_back(folder_ / name, std::move(text));
    }
  }
  void write() {
    write_files_atomically(files_);
    std::vector<fs::path> written;
    for (const auto& [path, text] : files_) written.push_back(path);
    if (!written.empty()) fmt::print("{}", written_line(written));
    if (!kept_.empty()) fmt::print("kept as they are: {}\n", fmt::join(kept_, ", "));
    files_.clear();
    kept_.clear();
  }

 private:
  fs::path folder_;
  std::vector<std::pair<fs::path, std::string>> files_;
  std::vector<std::string> kept_;
};

void print_remarks(const std::vector<std::string>& remarks) {
  for (std::size_t i = 0; i < std::min(remarks.size(), kMostRemarks); ++i)
    fmt::print("{} {}\n", coloured("note", Colour::warning), remarks[i]);
  if (remarks.size() > kMostRemarks) fmt::print("and {} more\n", remarks.size() - kMostRemarks);
}

void print_proposal(const CampaignProposal& found) {
  const auto row = [](const char* name, const std::string& words) { fmt::print("{:<8} {}\n", name, words); };
  row("photos", fmt::format("{} in {} poses, {} of a sheet", found.photographs, found.poses.size(),
                            found.sheet_photographs));
  if (found.photographs > 0) {
    row("markers", fmt::format("{}: fixed {}; moving {}", found.family, id_ranges_text(found.fixed),
                               found.moving.empty() ? "none" : id_ranges_text(found.moving)));
    row("", found.division);
    if (!found.division_sure && found.camera_there)
      row("", "say it with --fixed and --moving if this is wrong");
  }
  if (found.new_camera) {
    row("camera", found.new_camera->verdict);
  } else {
    row("camera", found.camera_there ? found.camera : "none yet");
  }
}

MarkerSizes sizes_of(const std::vector<int>& ids, const CampaignProposal& found) {
  MarkerSizes sizes;
  for (const int id : ids) {
    const auto own = found.sizes.find(id);
    sizes[id] = own != found.sizes.end() ? own->second : found.marker_mm;
  }
  return sizes;
}

std::string head() { return provenance_line(kVersion, "init", {}); }

std::optional<PlatformGeometry> machine_of(const InitFlags& flags, double gd_mm) {
  if (flags.machine.empty() && flags.joints.empty()) return std::nullopt;
  if (!flags.machine.empty() && !flags.joints.empty())
    throw InputError("--machine-mm and --joints: wanted one of them");
  if (!flags.machine.empty()) return symmetric_hexapod(parse_symmetric_hexapod(flags.machine), gd_mm);
  return hexapod_of_joints(flags.joints, flags.leg_mm, gd_mm);
}

int init_empty(const InitFlags& flags, CampaignProposal found, const Questions& questions) {
  found.family = found.family.empty() ? "tag36h11" : found.family;
  if (found.fixed.empty()) found.fixed = ids_of_flag("0-9", "--fixed");
  if (found.moving.empty()) found.moving = ids_of_flag("100-109", "--moving");
  fmt::print("no photographs yet in {}: stickers and a sheet to print\n", flags.folder.string());
  if (found.marker_mm == 0)
    found.marker_mm = questions.ask_number("edge of the stickers' black square, mm", 24);
  CampaignDraft draft;
  draft.family = found.family;
  draft.fixed = sizes_of(found.fixed, found);
  draft.moving = sizes_of(found.moving, found);
  draft.home = flags.home.empty() ? "home" : flags.home;
  draft.gd_mm = flags.gd_mm.value_or(50);
  NewFiles files(flags.folder);
  const auto machine = machine_of(flags, draft.gd_mm);
  draft.hexapod = machine || files.there("hexapod.yaml");
  if (machine) files.add("hexapod.yaml", hexapod_text(head(), *machine));
  draft.targets = files.there("targets.csv");
  for (auto& [name, text] : prints_for_new_campaign(draft, found.marker_mm)) files.add(name, std::move(text));
  files.add("campaign.yaml", campaign_text(head(), draft));
  if (!draft.targets) files.add("targets.csv", targets_template(head(), {draft.home}, draft.home));
  files.write();
  fmt::print(
      "print markers.pdf and sheet.pdf at 100 %; glue {} onto the fixed grip, {} onto the moving one;\n"
      "photograph the sheet into {}, each pose into a folder of {}, one of them called {}\n",
      id_ranges_text(found.fixed), id_ranges_text(found.moving), (flags.folder / "calibration").string(),
      (flags.folder / "poses").string(), draft.home);
  suggest_next("hexcal init " + shell_word(flags.folder.string()));
  return kDone;
}

void ask_about(CampaignProposal& found, CampaignDraft& draft, const InitFlags& flags,
               const Questions& questions) {
  if (found.marker_mm == 0)
    found.marker_mm =
        questions.ask_number("edge of the markers' black square on the grips, mm", std::nullopt);
  if (!found.moving.empty() && flags.fixed.empty() && flags.moving.empty()) {
    const std::string proposal = id_ranges_text(found.fixed);
    const std::string answer = questions.ask("ids on the grip that stands still", proposal);
    if (answer != proposal) {
      std::vector<int> all = found.fixed;
      all.insert(all.end(), found.moving.begin(), found.moving.end());
      found.fixed = ids_of_flag(answer, "fixed");
      std::erase_if(all, [&](int id) { return std::ranges::find(found.fixed, id) != found.fixed.end(); });
      std::sort(all.begin(), all.end());
      found.moving = all;
      found.division = "as told";
    }
  }
  draft.home = found.home_sure ? found.home : questions.ask("pose that is the home", found.home);
  if (std::ranges::find(found.poses, draft.home) == found.poses.end())
    throw InputError(
        fmt::format("home: found '{}', wanted one of {}", draft.home, fmt::join(found.poses, ", ")));
}

double gd_of(const InitFlags& flags, const CampaignProposal& found, const NewFiles& files) {
  if (flags.gd_mm) return *flags.gd_mm;
  if (files.there("hexapod.yaml")) return read_hexapod_file(flags.folder / "hexapod.yaml").gd_mm;
  const double edge_mm = sizes_of(found.fixed, found).begin()->second;
  return std::round(10 * found.gd_edges * edge_mm) / 10;
}

// What a folder may hold that is begun from nothing: hexcal's own files, and folders without files.
void refuse_nonsense(const fs::path& folder) {
  static const std::set<std::string> kOwn{
      "campaign.yaml", "camera.yaml", "camera.inputs.csv",  "hexapod.yaml", "targets.csv",
      "legs.csv",      "images.csv",  "markers.pdf",        "markers.yaml", "sheet.pdf",
      "sheet.yaml",    "joints.csv",  "markers_nominal.csv"};
  if (!fs::exists(folder)) return;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder, error)) {
    if (entry.is_directory(error) || entry.path().parent_path().filename() == "results") continue;
    const std::string name = entry.path().filename().string();
    if (kOwn.count(name) != 0 || name.starts_with(".")) continue;
    throw InputError(
        fmt::format("{}: holds {} but no photograph; wanted photographs, or a new folder to begin in",
                    folder.string(), name));
  }
}

// A campaign.yaml that is there stays; what the photographs say otherwise is said.
int complete_campaign(const InitFlags& flags, const CampaignProposal& found, NewFiles& files) {
  const Campaign campaign = read_campaign(flags.folder);
  files.write();
  const auto ids = [](const MarkerSizes& sizes) {
    std::vector<int> all;
    for (const auto& [id, size] : sizes) all.push_back(id);
    return all;
  };
  fmt::print("campaign.yaml is there and stays as it is\n");
  bool same = campaign.family == found.family;
  if (found.division_sure)
    same = same && ids(campaign.fixed) == found.fixed && ids(campaign.moving) == found.moving;
  if (!same) {
    fmt::print("{} campaign.yaml has {}: fixed {}; moving {}\n", coloured("note", Colour::warning),
               campaign.family, id_ranges_text(ids(campaign.fixed)), id_ranges_text(ids(campaign.moving)));
  }
  if (campaign.ug && campaign.ug->from == FrameRule::From::markers && campaign.targets) {
    if (const auto aligned = align_campaign(campaign))
      fmt::print("agrees best with the targets: {}\n", markers_frame_text(aligned->measured_from_targets));
  }
  suggest_next("hexcal run " + shell_word(flags.folder.string()));
  return same ? kDone : kSomeFailed;
}

int wait_for_more(const InitFlags& flags, const CampaignProposal& found, NewFiles& files) {
  files.write();
  const auto put = [&flags](const char* what, const char* where) {
    fmt::print("put {} into {}, then init again\n", what, (flags.folder / where).string());
  };
  if (!found.camera_there && found.sheets.empty()) {
    put("camera.yaml, or the sheet.yaml that hexcal template wrote for the camera's sheet,", "");
  } else if (!found.camera_there) {
    put("10 to 20 photographs of the camera's sheet", "calibration");
  }
  if (found.photographs == 0) put("the photographs of each pose", "poses/POSE");
  suggest_next("hexcal init " + shell_word(flags.folder.string()));
  return kSomeFailed;
}

int run_init(const InitFlags& flags) {
  ProposalRequest request;
  request.folder = flags.folder;
  request.family = flags.family;
  request.fixed = ids_of_flag(flags.fixed, "--fixed");
  request.moving = ids_of_flag(flags.moving, "--moving");
  request.home = flags.home;
  request.camera = flags.camera;
  request.sheet = flags.sheet;
  read_sizes_flag(flags.marker_mm, request);
  if (flags.gd_mm && !(*flags.gd_mm < kLongestMm))
    throw InputError(fmt::format("--gd-mm: found {}, wanted less than {}", *flags.gd_mm, kLongestMm));
  if (fs::exists(flags.folder) && !fs::is_directory(flags.folder))
    throw InputError(fmt::format("{}: is a file, wanted a folder", flags.folder.string()));
  const Questions questions(!flags.yes);
  BarObserver bar;
  CampaignProposal found = propose_campaign(request, bar);
  bar.end();
  if (found.photographs + found.sheet_photographs == 0 && found.remarks.empty()) {
    refuse_nonsense(flags.folder);
    return init_empty(flags, std::move(found), questions);
  }
  NewFiles files(flags.folder);
  if (found.new_camera) {
    for (auto& [name, text] : found.new_camera->files) files.add(name, std::move(text));
  }
  print_proposal(found);
  print_remarks(found.remarks);
  if (found.photographs == 0 || !found.camera_there) return wait_for_more(flags, found, files);
  if (files.there("campaign.yaml")) return complete_campaign(flags, found, files);
  if (found.marker_mm == 0 && !questions.asked())
    throw InputError(
        "--marker-mm is missing, wanted the edge of the grips' markers, mm: sizes have no default");
  CampaignDraft draft;
  ask_about(found, draft, flags, questions);
  draft.camera = found.camera;
  draft.images = found.images;
  draft.images_table = !found.table.empty();
  draft.family = found.family;
  draft.fixed = sizes_of(found.fixed, found);
  draft.moving = sizes_of(found.moving, found);
  draft.division = found.division;
  draft.gd_mm = gd_of(flags, found, files);
  draft.nominal = files.there("markers_nominal.csv");
  const auto machine = machine_of(flags, draft.gd_mm);
  draft.hexapod = machine || files.there("hexapod.yaml");
  if (machine) files.add("hexapod.yaml", hexapod_text(head(), *machine));
  draft.targets = files.there("targets.csv");
  draft.legs = files.there("legs.csv");
  if (!draft.targets) files.add("targets.csv", targets_template(head(), found.poses, draft.home));
  if (draft.images_table) files.add("images.csv", images_table_text(head(), found.table));
  files.write();
  if (draft.targets && !draft.nominal && !draft.moving.empty()) {
    const Campaign campaign = parse_campaign(campaign_text(head(), draft), flags.folder / "campaign.yaml");
    if (const auto aligned = align_campaign(campaign)) {
      draft.markers_from_UG = aligned->measured_from_targets;
      fmt::print("frame UG agrees best with targets.csv; {:.2g} deg rms remain\n", aligned->rms_deg);
    }
  }
  files.add("campaign.yaml", campaign_text(head(), draft));
  files.write();
  (void)read_campaign(flags.folder);
  suggest_next("hexcal run " + shell_word(flags.folder.string()));
  return found.division_sure ? kDone : kSomeFailed;
}

}  // namespace

void add_init_command(CLI::App& app, Action& action) {
  auto flags = std::make_shared<InitFlags>();
  CLI::App* command =
      app.add_subcommand("init", "From a folder of photographs, or from nothing, to a campaign");
  command->footer(
      "Example:\n  hexcal init card/ --marker-mm 24\n"
      "  photos   27 in 9 poses, 14 of a sheet\n"
      "  markers  tag36h11: fixed 0-9; moving 100-109\n"
      "           two groups move against each other in 9 poses; the upper one is taken as fixed\n"
      "  camera   good, 0.011 px rms\n"
      "  wrote card: camera.yaml, camera.inputs.csv, targets.csv, images.csv, campaign.yaml\n"
      "Nothing that is there is written over. A folder without photographs gets stickers and a sheet to "
      "print.\n"
      "Exit code 0 done, 1 written, but something in it could not be told (said), 2 nothing to make of the "
      "folder.");
  command->add_option("folder", flags->folder, "Folder of photographs: per pose, or a memory card's")
      ->required();
  command->add_option("--marker-mm", flags->marker_mm,
                      "Edge of the grips' black squares, mm: 24, or 24,100-109:12 where some differ");
  command->add_option("--fixed", flags->fixed, "Ids on the grip that stands still, such as 0-9");
  command->add_option("--moving", flags->moving, "Ids on the grip that moves");
  command->add_option("--family", flags->family,
                      "Marker family (default: the one that the photographs show)");
  command->add_option("--home", flags->home,
                      "Pose that is the home (default: the one called home, else the first)");
  command->add_option("--gd-mm", flags->gd_mm, "Distance from O_LG to O_UG at home (default: measured)")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--camera", flags->camera,
                      "Camera file (default: the one in the folder, or made of a sheet)");
  command->add_option("--sheet", flags->sheet,
                      "sheet.yaml of the camera's sheet (default: the one in the folder)");
  command->add_option("--machine-mm", flags->machine,
                      "A symmetric machine: base radius, distance in a pair of base joints, platform radius, "
                      "distance in a pair of platform joints, shortest and longest leg, with commas");
  command->add_option("--joints", flags->joints,
                      "Its 12 joints instead: CSV leg,body,x_mm,y_mm,z_mm (base, platform)");
  command->add_option("--leg-mm", flags->leg_mm, "With --joints: shortest and longest leg, with a comma");
  command->add_flag("--yes", flags->yes, "Take every proposal, ask nothing");
  command->callback([flags, &action] { action = [flags] { return run_init(*flags); }; });
}

}  // namespace hexcal
