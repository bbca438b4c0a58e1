#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "kinematics/geometry/input_error.h"
#include "tools/hexcal/camera_photographs.h"
#include "tools/hexcal/command.h"
#include "tools/hexcal/terminal.h"
#include "tools/hexcal/version.h"
#include "tools/io/atomic_file.h"
#include "tools/io/camera_file.h"
#include "tools/io/sheet_file.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct Flags {
  std::vector<fs::path> images;
  std::vector<fs::path> templates;
  fs::path output;
  std::string lens;
  std::string board;
  bool json = false;
};

constexpr const char* kSynopsis =
    R"(Calibrate a camera at one zoom setting from 10 to 20 photographs of a printed sheet.

  hexcal camera photographs/ --template sheet.yaml -o camera.yaml

  photograph     points  rejected  rms_px  tilt_deg  distance_mm  blur_px  status
  DSC_0001.JPG      164         0   0.011      31.2        912.4     0.71  ok
  ...
  f_px      9011.13 +- 0.21
  verdict: good

Exit code 1 if photographs failed or the verdict is retake; the camera file is written all the same.)";

std::vector<Sheet> read_sheets(const std::vector<fs::path>& files) {
  std::vector<Sheet> sheets;
  for (const fs::path& file : files) {
    const std::vector<Sheet> more = read_sheet_file(file);
    sheets.insert(sheets.end(), more.begin(), more.end());
  }
  return sheets;
}

CalibrateOptions options_of(const Flags& flags) {
  CalibrateOptions options;
  if (!flags.lens.empty()) options.lens = lens_model_from_name(flags.lens);
  for (const BoardFreedom board : {BoardFreedom::ideal, BoardFreedom::warped, BoardFreedom::points}) {
    if (flags.board == board_freedom_name(board)) options.board = board;
  }
  return options;
}

void print_photographs(const CameraReport& report) {
  TextTable table(
      {"photograph", "points", "rejected", "rms_px", "tilt_deg", "distance_mm", "blur_px", "status"});
  table.align_left(7);
  for (const PhotographRow& row : report.photographs) {
    if (row.used) {
      table.add_row({row.name, fmt::format("{}", row.points), fmt::format("{}", row.rejected),
                     fmt::format("{:.3f}", row.rms_px), fmt::format("{:.1f}", row.tilt_deg),
                     fmt::format("{:.1f}", row.distance_mm), fmt::format("{:.2f}", row.blur_px), row.status},
                    row.status == "ok" ? Colour::plain : Colour::warning);
    } else {
      table.add_row({row.name, "0", fmt::format("{}", row.rejected), "", "", "", "", row.status},
                    Colour::bad);
    }
  }
  fmt::print("{}\n", table.text());
}

void print_models(const CameraCalibration& calibration) {
  TextTable table({"model", "unknowns", "AICc", "cross-validation_px", ""});
  for (const ModelTrial& trial : calibration.trials) {
    table.add_row({trial.name, fmt::format("{}", trial.unknowns), fmt::format("{:.1f}", trial.aicc),
                   trial.cross_validation_px ? fmt::format("{:.4f}", *trial.cross_validation_px) : "",
                   trial.chosen ? "chosen" : ""},
                  trial.chosen ? Colour::bold : Colour::plain);
  }
  fmt::print("{}\n", table.text());
}

void print_parameters(const CameraModel& camera, const CameraReport& report) {
  const auto& names = camera_parameter_names(camera.lens);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const double sigma = std::sqrt(report.covariance(at, at));
    const bool pixels = i == 0 || i == 2 || i == 3;
    if (sigma > 0) {
      const std::string digits = pixels ? fmt::format("{:.3f} +- {:.3f}", camera.parameters[at], sigma)
                                        : fmt::format("{:.6g} +- {:.2g}", camera.parameters[at], sigma);
      fmt::print("{:<9} {}\n", names[i], digits);
    } else if (camera.parameters[at] != 0) {
      fmt::print("{:<9} {:.6g} (held)\n", names[i], camera.parameters[at]);
    }
  }
}

void print_summary(const CameraCalibration& calibration, const CameraReport& report) {
  const CameraQuality& q = report.quality;
  print_parameters(calibration.fit.adjustment.state.camera, report);
  fmt::print("\nrms_px {:.3f}   sigma0 {:.2f}   unexplained_px {:.3f}   points {}   photographs {}\n",
             q.rms_px, q.sigma0, calibration.fit.extra_sigma_px, q.points, q.photographs);
  fmt::print(
      "projection uncertainty: centre {:.4f} px, worst corner {:.4f} px; halves differ by {:.4f} px rms; "
      "coverage "
      "{:.0f} %\n",
      q.uncertainty_centre_px, q.uncertainty_corner_px, q.cross_validation_px, q.coverage_percent);
  if (!report.correlations.empty()) {
    std::vector<std::string> pairs;
    for (const CorrelatedPair& pair : report.correlations) {
      pairs.push_back(fmt::format("{}-{} {:.3f}", pair.first, pair.second, pair.correlation));
    }
    fmt::print("correlations over 0.95: {}\n", fmt::join(pairs, ", "));
  }
}

void print_verdict(const CameraReport& report) {
  const CameraVerdict verdict = report.quality.verdict;
  const Colour colour = verdict == CameraVerdict::good     ? Colour::good
                        : verdict == CameraVerdict::usable ? Colour::warning
                                                           : Colour::bad;
  fmt::print("\nverdict: {}\n", coloured(camera_verdict_name(verdict), colour));
  for (const Advice& advice : report.advice) fmt::print("  - {}\n", advice.words);
}

Json json_of(const CameraCalibration& calibration, const CameraReport& report) {
  Json out;
  out["verdict"] = camera_verdict_name(report.quality.verdict);
  for (const Advice& advice : report.advice) out["advice"].push_back(advice.words);
  for (const PhotographRow& row : report.photographs) {
    out["photographs"].push_back({{"name", row.name},
                                  {"status", row.status},
                                  {"used", row.used},
                                  {"points", row.points},
                                  {"rejected", row.rejected},
                                  {"rms_px", row.rms_px},
                                  {"tilt_deg", row.tilt_deg},
                                  {"distance_mm", row.distance_mm},
                                  {"blur_px", row.blur_px}});
  }
  if (calibration.status != CalibrationStatus::ok) return out;
  const CameraModel& camera = calibration.fit.adjustment.state.camera;
  out["model"] = lens_model_name(camera.lens);
  out["board"] = board_freedom_name(calibration.variant.board);
  const auto& names = camera_parameter_names(camera.lens);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    out["parameters"][names[i]] = {{"value", camera.parameters[at]},
                                   {"sigma", std::sqrt(report.covariance(at, at))}};
  }
  const CameraQuality& q = report.quality;
  out["rms_px"] = q.rms_px;
  out["sigma0"] = q.sigma0;
  out["unexplained_px"] = calibration.fit.extra_sigma_px;
  out["points"] = q.points;
  out["uncertainty_centre_px"] = q.uncertainty_centre_px;
  out["uncertainty_corner_px"] = q.uncertainty_corner_px;
  out["cross_validation_px"] = q.cross_validation_px;
  out["coverage_percent"] = q.coverage_percent;
  for (const ModelTrial& trial : calibration.trials) {
    Json entry{
        {"name", trial.name}, {"unknowns", trial.unknowns}, {"aicc", trial.aicc}, {"chosen", trial.chosen}};
    if (trial.cross_validation_px) entry["cross_validation_px"] = *trial.cross_validation_px;
    out["models"].push_back(entry);
  }
  return out;
}

int run(const Flags& flags) {
  const std::vector<Sheet> sheets = read_sheets(flags.templates);
  const std::vector<fs::path> paths = photograph_paths(flags.images);
  const MeasuredCamera measured = measure_camera(paths, sheets, options_of(flags));
  const CameraCalibration& calibration = measured.calibration;
  const CameraReport report = report_calibration(sheets, measured.photographs, calibration);
  const bool done = calibration.status == CalibrationStatus::ok;
  if (done) {
    const CalibratedCamera camera{calibration.fit.adjustment.state.camera, report.covariance,
                                  measured.setting, report.quality};
    const std::string head = provenance_line(kVersion, "camera", flags.templates);
    write_file_atomically(flags.output, format_camera_file(head, camera));
  }
  if (flags.json) {
    fmt::print("{}\n", json_of(calibration, report).dump(2));
  } else {
    print_photographs(report);
    if (done) {
      print_models(calibration);
      print_summary(calibration, report);
    }
    print_verdict(report);
    if (done) fmt::print("\nwrote {}\n", flags.output.string());
  }
  if (!done) throw InputError(calibration.reason);
  const bool some_failed = std::any_of(report.photographs.begin(), report.photographs.end(),
                                       [](const PhotographRow& row) { return row.status != "ok"; });
  return some_failed || report.quality.verdict == CameraVerdict::retake ? kSomeFailed : kDone;
}

}  // namespace

void add_camera_command(CLI::App& app, Action& action) {
  auto flags = std::make_shared<Flags>();
  CLI::App* command = app.add_subcommand("camera", kSynopsis);
  command->add_option("IMAGES", flags->images, "photographs, or folders of them")->required();
  command->add_option("--template", flags->templates, "sheet.yaml of the printed sheet; may be repeated")
      ->required();
  command->add_option("-o,--output", flags->output, "camera file to write")->required();
  command->add_option("--model", flags->lens, "lens model instead of the one chosen by evidence")
      ->check(CLI::IsMember({"brown", "rational", "radial"}));
  command
      ->add_option("--board", flags->board,
                   "freedom of the printed sheet instead of the one chosen by evidence")
      ->check(CLI::IsMember({"ideal", "warped", "points"}));
  command->add_flag("--json", flags->json, "print JSON");
  command->callback([flags, &action] { action = [flags] { return run(*flags); }; });
}

}  // namespace hexcal
