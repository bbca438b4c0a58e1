#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "camera_calib/camera_report.h"
#include "camera_calib/compare_cameras.h"
#include "camera_calib/measure_camera.h"
#include "kinematics/geometry/input_error.h"
#include "photogrammetry/photograph/photograph_format.h"
#include "tools/hexcal/acceptance_limits.h"
#include "tools/hexcal/camera_library.h"
#include "tools/hexcal/camera_tables.h"
#include "tools/hexcal/command.h"
#include "tools/hexcal/terminal.h"
#include "tools/io/atomic_file.h"
#include "tools/io/calibration_tables.h"
#include "tools/io/camera_file.h"
#include "tools/io/json_text.h"
#include "tools/io/sheet_file.h"
#include "tools/io/template_pdf.h"
#include "tools/io/version.h"
#include "tools/report/camera_page.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

struct CameraFlags {
  std::vector<fs::path> images;
  std::vector<fs::path> templates;
  fs::path output;
  fs::path library;
  fs::path poses;
  fs::path report;
  std::vector<fs::path> compare;
  std::string ruler;
  std::string lens;
  std::string board;
  AcceptanceLimits limits;
  bool list = false;
  bool json = false;
};

constexpr const char* kCameraFooter = R"(  hexcal camera photographs/ --template sheet.yaml -o camera.yaml

  photograph     points  rejected  rms_px  tilt_deg  distance_mm  blur_px  status
  DSC_0001.JPG      164         0   0.011      31.2        912.4     0.71  ok
  ...
  f_px      9011.13 +- 0.21
  verdict: good

  hexcal camera --library cameras/ --list   the camera files of a library with their lens settings
  hexcal camera --compare a.yaml b.yaml     how far two calibrations differ, and whether that is more than noise

Exit code 1 if photographs failed or the verdict is retake; the camera file is written all the same.)";

// Files as given, folders replaced by the photographs in them, sorted.
std::vector<fs::path> photograph_paths(const std::vector<fs::path>& given) {
  std::vector<fs::path> out;
  for (const fs::path& path : given) {
    std::error_code error;
    if (!fs::is_directory(path, error)) {
      if (!fs::exists(path, error))
        throw InputError(fmt::format("{}: no such file or folder", path.string()));
      out.push_back(path);
      continue;
    }
    std::vector<fs::path> found;
    for (const auto& entry : fs::directory_iterator(path)) {
      if (entry.is_regular_file() && photograph_format(entry.path()) != PhotographFormat::none)
        found.push_back(entry.path());
    }
    if (found.empty()) {
      throw InputError(fmt::format("{}: holds no photograph ({})", path.string(), photograph_endings()));
    }
    std::sort(found.begin(), found.end());
    out.insert(out.end(), found.begin(), found.end());
  }
  return out;
}

std::vector<Sheet> read_sheets(const std::vector<fs::path>& files) {
  std::vector<Sheet> sheets;
  for (const fs::path& file : files) {
    const std::vector<Sheet> more = read_sheet_file(file);
    sheets.insert(sheets.end(), more.begin(), more.end());
  }
  return sheets;
}

CameraCalibrationOptions options_of(const CameraFlags& flags) {
  CameraCalibrationOptions options;
  if (!flags.lens.empty()) options.lens = lens_model_from_name(flags.lens);
  for (const BoardFreedom board : {BoardFreedom::ideal, BoardFreedom::warped, BoardFreedom::points}) {
    if (flags.board == board_freedom_name(board)) options.board = board;
  }
  return options;
}

// What the printer made of the two 100 mm rulers: only their mean scales the sheet, what they differ by is
// estimated with the sheet's shape.
void apply_ruler(const std::string& text, std::vector<Sheet>& sheets) {
  if (text.empty()) return;
  const auto measured = paper_size(text);
  const auto plausible = [](double mm) { return mm > 90 && mm < 110; };
  if (!measured || !plausible(measured->width_mm) || !plausible(measured->height_mm)) {
    throw InputError(fmt::format(
        "--measured-ruler-mm: found '{}', wanted the two 100 mm rulers' lengths as in 99.4x99.7", text));
  }
  const double scale = std::sqrt(measured->width_mm * measured->height_mm) / 100;
  for (Sheet& sheet : sheets) {
    for (double* size : {&sheet.marker_mm, &sheet.spacing_mm, &sheet.pitch_mm, &sheet.dot_mm}) *size *= scale;
  }
}

int compare(const CameraFlags& flags) {
  const CameraComparison result =
      compare_cameras(read_camera_file(flags.compare[0]), read_camera_file(flags.compare[1]));
  const ProjectionDifference& d = result.difference;
  if (flags.json) {
    const nlohmann::ordered_json out{{"difference_rms_px", d.rms_px},
                                     {"difference_max_px", d.max_px},
                                     {"expected_rms_px", result.expected_rms_px},
                                     {"significant", result.significant}};
    fmt::print("{}\n", json_text(out, 2));
    return kDone;
  }
  fmt::print(
      "difference of projection over the frame, best rotation taken out, px (every fifth of the frame):\n");
  for (int row = 0; row < d.rows; row += 4) {
    for (int column = 0; column < d.columns; column += 5) {
      fmt::print("{:8.4f}", d.difference_px[static_cast<std::size_t>(row * d.columns + column)].norm());
    }
    fmt::print("\n");
  }
  fmt::print("rms {:.4f} px, largest {:.4f} px", d.rms_px, d.max_px);
  if (result.expected_rms_px > 0) {
    fmt::print("; expected from both uncertainties {:.4f} px rms: {}", result.expected_rms_px,
               result.significant ? "the cameras differ significantly" : "no significant difference");
  }
  fmt::print("\n");
  return kDone;
}

int list_library(const CameraFlags& flags) {
  if (flags.library.empty()) throw InputError("--list: wanted --library DIR");
  const std::vector<LibraryEntry> entries = read_camera_library(flags.library);
  fmt::print("{}", flags.json ? camera_library_json(entries) : camera_library_table(entries));
  const bool all_read =
      std::all_of(entries.begin(), entries.end(), [](const auto& e) { return e.fault.empty(); });
  return all_read ? kDone : kSomeFailed;
}

using NamedText = std::pair<fs::path, std::string>;

// Everything asked for but the page.
std::vector<NamedText> files_of(const CameraFlags& flags, const std::vector<Sheet>& sheets,
                                const MeasuredCamera& measured, const CameraReport& report) {
  const CalibratedCamera camera{measured.calibration.fit.adjustment.state.camera, report.covariance,
                                measured.setting, report.quality};
  const std::string head = provenance_line(kVersion, "camera", flags.templates);
  std::vector<fs::path> cameras;
  if (!flags.output.empty()) cameras.push_back(flags.output);
  if (!flags.library.empty())
    cameras.push_back(flags.library / (setting_file_stem(measured.setting) + ".yaml"));
  std::vector<NamedText> files;
  const auto write = [&files](const fs::path& path, std::string text) {
    files.emplace_back(path, std::move(text));
  };
  for (const fs::path& path : cameras) {
    write(path, format_camera_file(head, camera));
    write(fs::path(path).replace_extension(".inputs.csv"),
          format_calibration_inputs(head, sheets, measured.photographs, measured.calibration));
  }
  if (!flags.poses.empty())
    write(flags.poses, format_sheet_poses(head, measured.photographs, measured.calibration));
  return files;
}

int run_camera(const CameraFlags& flags) {
  if (!flags.compare.empty()) return compare(flags);
  if (flags.list) return list_library(flags);
  if (flags.images.empty()) throw InputError("IMAGES: wanted photographs or a folder of them");
  if (flags.templates.empty()) throw InputError("--template: wanted the sheet.yaml of the printed sheet");
  if (flags.output.empty() && flags.library.empty())
    throw InputError("wanted -o camera.yaml or --library DIR");
  std::vector<Sheet> sheets = read_sheets(flags.templates);
  apply_ruler(flags.ruler, sheets);
  const std::vector<fs::path> paths = photograph_paths(flags.images);
  ProgressBar bar("measuring", 2 * paths.size());
  const MeasuredCamera measured = measure_camera(paths, sheets, options_of(flags), [&bar] { bar.advance(); });
  const CameraCalibration& calibration = measured.calibration;
  const CameraReport report = report_calibration(sheets, measured.photographs, calibration);
  const bool done = calibration.status == CalibrationStatus::ok;
  std::vector<NamedText> files;
  if (done) files = files_of(flags, sheets, measured, report);
  if (!flags.report.empty())
    files.emplace_back(flags.report, render_camera_page(sheets, calibration, flags.output.string(),
                                                        measured.setting, report));
  write_files_atomically(files);
  std::vector<std::string> written;
  for (const auto& [path, text] : files) written.push_back(path.string());
  if (flags.json) {
    fmt::print("{}\n", camera_json(calibration, report));
  } else {
    fmt::print("{}", camera_tables(calibration, report));
    if (done) fmt::print("\nwrote {}\n", fmt::join(written, ", "));
  }
  if (!done) throw InputError(calibration.reason);
  const bool some_failed = std::any_of(report.photographs.begin(), report.photographs.end(),
                                       [](const PhotographRow& row) { return row.status != "ok"; });
  const std::vector<std::string> passed = passed_limits(
      flags.limits,
      {std::nullopt, std::nullopt, report.quality.rms_px, report.quality.verdict == CameraVerdict::good});
  for (const std::string& line : passed) fmt::print(stderr, "limit: {}\n", line);
  const bool retake = report.quality.verdict == CameraVerdict::retake;
  return some_failed || retake || !passed.empty() ? kSomeFailed : kDone;
}

}  // namespace

void add_camera_command(CLI::App& app, Action& action) {
  auto flags = std::make_shared<CameraFlags>();
  CLI::App* command = app.add_subcommand(
      "camera", "Calibrate a camera at one zoom setting from 10 to 20 photographs of a printed sheet.");
  command->footer(kCameraFooter);
  command->add_option("IMAGES", flags->images, "photographs, or folders of them");
  command->add_option("--template", flags->templates, "sheet.yaml of the printed sheet; may be repeated");
  command->add_option("-o,--output", flags->output, "camera file to write");
  command->add_option(
      "--library", flags->library,
      "folder in which to file the camera by its lens setting; campaign.yaml takes the folder as `camera:`");
  command->add_flag("--list", flags->list, "list the library instead of calibrating");
  command->add_option("--poses", flags->poses,
                      "CSV to write: the sheet's pose in every photograph with sigmas");
  command->add_option("--report", flags->report,
                      "HTML page to write: coverage, residuals, uncertainty, every photograph");
  command->add_option("--compare", flags->compare, "two camera files to compare instead of calibrating")
      ->expected(2);
  command->add_option("--measured-ruler-mm", flags->ruler,
                      "lengths of the printed 100 mm rulers, across x down, as in 99.4x99.7");
  command->add_option("--model", flags->lens, "lens model instead of the one chosen by evidence")
      ->check(CLI::IsMember({"brown", "rational", "radial"}));
  command
      ->add_option("--board", flags->board,
                   "freedom of the printed sheet instead of the one chosen by evidence")
      ->check(CLI::IsMember({"ideal", "warped", "points"}));
  add_limit_flags(*command, flags->limits, {nullptr, nullptr, true, true});
  command->add_flag("--json", flags->json, "print JSON");
  command->callback([flags, &action] { action = [flags] { return run_camera(*flags); }; });
}

}  // namespace hexcal
