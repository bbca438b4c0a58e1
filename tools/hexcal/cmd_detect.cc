#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/printable_text.h"
#include "photogrammetry/markers/detect.h"
#include "photogrammetry/photograph/photograph_format.h"
#include "photogrammetry/photograph/sha256.h"
#include "tools/hexcal/command.h"
#include "tools/hexcal/terminal.h"
#include "tools/io/atomic_file.h"
#include "tools/io/camera_file.h"
#include "tools/io/json_text.h"
#include "tools/io/observations_file.h"
#include "tools/io/version.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDetectFooter = R"(Sample output:
  photograph    found  not usable
  DSC_0001.JPG     16
  DSC_0002.JPG     15  104 cut_by_frame
  2 photographs, 31 markers in observations.txt)";

struct DetectFlags {
  std::vector<fs::path> images;
  std::string family = "tag36h11";
  std::vector<int> ids;
  fs::path camera;
  fs::path relative_to;
  fs::path output;
  bool json = false;
};

struct Source {
  fs::path path;
  std::string name;  // as written
};

// The deepest folder above all that was given.
fs::path common_folder(const std::vector<fs::path>& inputs) {
  fs::path common;
  for (const fs::path& input : inputs) {
    const fs::path whole = fs::absolute(fs::is_directory(input) ? input / "" : input).lexically_normal();
    const fs::path folder = whole.parent_path();
    if (&input == &inputs.front()) {
      common = folder;
      continue;
    }
    fs::path shared;
    const auto end = std::mismatch(common.begin(), common.end(), folder.begin(), folder.end()).first;
    for (auto part = common.begin(); part != end; ++part) shared /= *part;
    common = shared;
  }
  return common;
}

std::string name_below(const fs::path& folder, const fs::path& file) {
  const fs::path name =
      fs::absolute(file).lexically_normal().lexically_relative(fs::absolute(folder / "").lexically_normal());
  if (name.empty() || *name.begin() == "..")
    throw InputError(
        fmt::format("--relative-to: found {}, wanted a folder above {}", folder.string(), file.string()));
  return printable_text(name.generic_string());
}

// Names are relative to `base`, or, without one, to the folder that was given; where two files would have one
// name, to the folder that holds all that was given. What was given twice is taken once.
std::vector<Source> list_photographs(const std::vector<fs::path>& inputs, const fs::path& base) {
  std::vector<Source> sources;
  std::set<fs::path> files;
  std::set<std::string> names;
  const auto add = [&](const fs::path& file, const fs::path& folder) {
    if (!files.insert(fs::absolute(file).lexically_normal()).second) return;
    sources.push_back({file, name_below(base.empty() ? folder : base, file)});
    names.insert(sources.back().name);
  };
  for (const fs::path& input : inputs) {
    if (!fs::is_directory(input)) {
      if (!fs::exists(input)) throw InputError(fmt::format("{}: no such file", input.string()));
      add(input, input.has_parent_path() ? input.parent_path() : ".");
      continue;
    }
    std::vector<fs::path> found;
    for (const auto& entry : fs::recursive_directory_iterator(input)) {
      if (entry.is_regular_file() && photograph_format(entry.path()) != PhotographFormat::none)
        found.push_back(entry.path());
    }
    std::sort(found.begin(), found.end(),
              [](const fs::path& a, const fs::path& b) { return a.generic_string() < b.generic_string(); });
    if (found.empty()) throw InputError(fmt::format("{}: no photographs in this folder", input.string()));
    for (const fs::path& file : found) add(file, input);
  }
  if (names.size() == sources.size()) return sources;
  const fs::path common = common_folder(inputs);
  for (Source& source : sources) source.name = name_below(common, source.path);
  return sources;
}

std::string not_usable(const PhotographObservations& photograph) {
  if (photograph.status != PhotographStatus::ok) {
    return fmt::format("{}: {}", photograph_status_name(photograph.status), photograph.reason);
  }
  std::string text;
  for (const auto& marker : photograph.markers) {
    if (marker.status == MarkerStatus::ok) continue;
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", marker.id, marker_status_name(marker.status));
  }
  return text;
}

int count_ok(const PhotographObservations& photograph) {
  return static_cast<int>(
      std::count_if(photograph.markers.begin(), photograph.markers.end(),
                    [](const MarkerObservation& marker) { return marker.status == MarkerStatus::ok; }));
}

int run_detect(const DetectFlags& flags) {
  const MarkerFamily& family = marker_family(flags.family);
  const std::vector<Source> sources = list_photographs(flags.images, flags.relative_to);
  std::optional<CalibratedCamera> camera;
  DetectionSet set{flags.family, {}, {}};
  if (!flags.camera.empty()) {
    camera = read_camera_file(flags.camera);
    set.camera_sha256 = sha256_hex(read_file(flags.camera));
  }
  DetectionOptions options;
  options.ids = flags.ids;
  options.validate();
  set.photographs.resize(sources.size());
  {
    ProgressBar bar("detect", sources.size());
    tbb::parallel_for(std::size_t{0}, sources.size(), [&](std::size_t i) {
      const Photograph photograph = read_photograph(sources[i].path);
      set.photographs[i] = observe_photograph(photograph, family, options, camera ? &camera->model : nullptr);
      set.photographs[i].name = sources[i].name;
      bar.advance();
    });
  }
  write_file_atomically(flags.output,
                        observations_text(set, provenance_line(kVersion, "detect", {flags.camera})));

  int markers = 0;
  bool failed = false;
  TextTable table({"photograph", "found", "not usable"});
  table.align_left(2);
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const auto& photograph : set.photographs) {
    const int ok = count_ok(photograph);
    const bool bad = photograph.status != PhotographStatus::ok;
    markers += ok;
    failed = failed || bad;
    table.add_row({photograph.name, fmt::format("{}", ok), not_usable(photograph)},
                  bad ? Colour::bad : Colour::plain);
    rows.push_back({{"photograph", photograph.name},
                    {"status", photograph_status_name(photograph.status)},
                    {"markers", ok},
                    {"not_usable", not_usable(photograph)}});
  }
  if (flags.json) {
    fmt::print("{}\n", json_text(nlohmann::ordered_json{{"photographs", rows}, {"markers", markers}}, 2));
  } else {
    fmt::print("{}{} photographs, {} markers in {}\n", table.text(), set.photographs.size(), markers,
               flags.output.string());
    suggest_next("hexcal measure CAMPAIGN --observations " + shell_word(flags.output.string()));
  }
  return failed ? kSomeFailed : kDone;
}

}  // namespace

void add_detect_command(CLI::App& app, Action& action) {
  CLI::App* command =
      app.add_subcommand("detect", "Measure the markers in photographs, for measure --observations");
  command->footer(kDetectFooter);
  const auto flags = std::make_shared<DetectFlags>();
  command->add_option("IMAGES", flags->images, "photographs, or folders of them")->required();
  command->add_option("--family", flags->family, "of the markers: tag36h11, DICT_4X4_50, ...")
      ->capture_default_str();
  command->add_option("--ids", flags->ids, "look for these ids only")->delimiter(',');
  command->add_option("--camera", flags->camera, "camera.yaml whose lens stands inside the measurement");
  command->add_option("--relative-to", flags->relative_to,
                      "write names relative to this folder: with the campaign's folder of photographs, as "
                      "measure --observations wants them");
  command->add_option("-o,--output", flags->output, "file of observations to write")->required();
  command->add_flag("--json", flags->json, "print the summary as JSON");
  command->callback([&action, flags] { action = [flags] { return run_detect(*flags); }; });
}

}  // namespace hexcal
