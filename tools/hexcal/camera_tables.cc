#include "tools/hexcal/camera_tables.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tools/hexcal/terminal.h"
#include "tools/io/json_text.h"

namespace hexcal {
namespace {

using Json = nlohmann::ordered_json;

std::string photograph_table(const CameraReport& report) {
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
  return table.text() + '\n';
}

std::string model_table(const CameraCalibration& calibration) {
  TextTable table({"model", "unknowns", "AICc", "cross-validation_px", ""});
  for (const ModelTrial& trial : calibration.trials) {
    table.add_row({trial.name, fmt::format("{}", trial.unknowns), fmt::format("{:.1f}", trial.aicc),
                   trial.cross_validation_px ? fmt::format("{:.4f}", *trial.cross_validation_px) : "",
                   trial.chosen ? "chosen" : ""},
                  trial.chosen ? Colour::bold : Colour::plain);
  }
  return table.text() + '\n';
}

std::string parameter_lines(const CameraModel& camera, const CameraReport& report) {
  const auto& names = camera_parameter_names(camera.lens);
  std::string out;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const double sigma = std::sqrt(report.covariance(at, at));
    const double value = camera.parameters[at];
    const bool pixels = i == 0 || i == 2 || i == 3;
    if (sigma > 0) {
      out += pixels ? fmt::format("{:<9} {:.3f} +- {:.3f}\n", names[i], value, sigma)
                    : fmt::format("{:<9} {:.6g} +- {:.2g}\n", names[i], value, sigma);
    } else if (value != 0) {
      out += fmt::format("{:<9} {:.6g} (held)\n", names[i], value);
    }
  }
  return out;
}

std::string summary_lines(const CameraCalibration& calibration, const CameraReport& report) {
  const CameraQuality& q = report.quality;
  std::string out =
      fmt::format("\nrms_px {:.3f}   sigma0 {:.2f}   unexplained_px {:.3f}   points {}   photographs {}\n",
                  q.rms_px, q.sigma0, calibration.fit.extra_sigma_px, q.points, q.photographs);
  out += fmt::format(
      "projection uncertainty: centre {:.4f} px, worst corner {:.4f} px\nhalves of the photographs differ by "
      "{:.4f} px "
      "rms; coverage {:.0f} %\n",
      q.uncertainty_centre_px, q.uncertainty_corner_px, q.cross_validation_px, q.coverage_percent);
  if (!report.correlations.empty()) {
    std::vector<std::string> pairs;
    for (const CameraCorrelation& pair : report.correlations) {
      pairs.push_back(fmt::format("{}-{} {:.3f}", pair.first, pair.second, pair.correlation));
    }
    out += fmt::format("correlations over 0.95: {}\n", fmt::join(pairs, ", "));
  }
  return out;
}

std::string verdict_lines(const CameraReport& report) {
  const CameraVerdict verdict = report.quality.verdict;
  const Colour colour = verdict == CameraVerdict::good     ? Colour::good
                        : verdict == CameraVerdict::usable ? Colour::warning
                                                           : Colour::bad;
  std::string out = fmt::format("\nverdict: {}\n", coloured(camera_verdict_name(verdict), colour));
  for (const Advice& advice : report.advice) out += fmt::format("  - {}\n", advice.words);
  return out;
}

}  // namespace

std::string camera_tables(const CameraCalibration& calibration, const CameraReport& report) {
  std::string out = photograph_table(report);
  if (calibration.status == CalibrationStatus::ok) {
    out += model_table(calibration);
    out += parameter_lines(calibration.fit.adjustment.state.camera, report);
    out += summary_lines(calibration, report);
  }
  return out + verdict_lines(report);
}

std::string camera_json(const CameraCalibration& calibration, const CameraReport& report) {
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
  if (calibration.status != CalibrationStatus::ok) return json_text(out, 2);
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
  return json_text(out, 2);
}

}  // namespace hexcal
