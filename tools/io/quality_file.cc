#include "tools/io/quality_file.h"

#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "kinematics/geometry/input_error.h"
#include "pose_extract/pose_verdict.h"
#include "tools/io/atomic_file.h"
#include "tools/io/json_text.h"
#include "tools/io/measured_poses.h"

namespace hexcal {
namespace {

using Json = nlohmann::ordered_json;

// "9.2" back to a point; a centre is written 9.-1.
MarkerPoint parse_point(const std::string& text) {
  MarkerPoint point;
  if (std::sscanf(text.c_str(), "%d.%d", &point.id, &point.corner) < 1)
    throw InputError(fmt::format("found '{}', wanted a marker's point such as 9.2", text));
  return point;
}

std::vector<MeasuredLength> parse_lengths(const Json& rows) {
  std::vector<MeasuredLength> lengths;
  for (const Json& row : rows) {
    MeasuredLength length;
    length.known.a = parse_point(row.at("a").get<std::string>());
    length.known.b = parse_point(row.at("b").get<std::string>());
    length.known.length_mm = row.at("stated_mm").get<double>();
    length.measured = row.at("measured").get<bool>();
    length.length_mm = row.at("length_mm").get<double>();
    length.sigma_mm = row.at("sigma_mm").get<double>();
    lengths.push_back(length);
  }
  return lengths;
}

Severity severity_of(const std::string& name) {
  for (const Severity severity : {Severity::good, Severity::warning}) {
    if (name == severity_name(severity)) return severity;
  }
  return Severity::bad;
}

DatumFrame parse_datum(const Json& json) {
  DatumFrame frame;
  frame.ok = json.at("ok").get<bool>();
  frame.reason = json.at("reason").get<std::string>();
  frame.scale = json.at("scale").get<double>();
  frame.notes = json.at("notes").get<std::vector<std::string>>();
  for (const Json& row : json.at("residuals")) {
    DatumResidual residual;
    residual.point = {row.at("id").get<int>(), row.at("corner").get<int>()};
    const auto mm = row.at("residual_mm").get<std::array<double, 3>>();
    residual.residual_mm = {mm[0], mm[1], mm[2]};
    residual.used = row.at("used").get<bool>();
    frame.residuals.push_back(residual);
  }
  return frame;
}

}  // namespace

std::string quality_text(const CampaignObservations& observations, const CampaignResult& result,
                         const ImageListing& listing, const std::string& measurement) {
  const AdjustmentResult& adjusted = result.adjusted;
  Json json;
  json["measurement"] = measurement;
  json["status"] = adjusted.status == AdjustmentStatus::ok ? "ok" : adjusted.reason;
  json["sigma0"] = adjusted.sigma0;
  json["redundancy"] = adjusted.redundancy_total;
  json["rms_px"] = adjusted.rms_px;
  json["free_corners"] = adjusted.shape_free;
  json["print_scale"] = 1 + adjusted.geometry.print_scale;
  json["interior_chi2"] = adjusted.interior_chi2;
  json["interior_dof"] = adjusted.interior_dof;
  json["poses"] = Json::array();
  for (const MeasuredPose& pose : result.poses) {
    Json row{{"pose", pose.id}, {"status", pose_status_name(pose.status)}, {"words", pose.words}};
    if (pose.pose) {
      const Vector6d v = mm_deg(pose.pose->vector());
      const Vector6d s = mm_deg(pose_sigmas(pose));
      row["xyz_mm"] = {v[0], v[1], v[2]};
      row["rpy_deg"] = {v[3], v[4], v[5]};
      row["sigma_xyz_mm"] = {s[0], s[1], s[2]};
      row["sigma_rpy_deg"] = {s[3], s[4], s[5]};
    }
    row["images"] = pose.images;
    row["markers"] = pose.markers;
    row["rms_px"] = pose.rms_px;
    row["intersection_deg"] = pose.intersection_deg;
    json["poses"].push_back(row);
  }
  json["photographs"] = Json::array();
  for (std::size_t p = 0; p < result.photographs.size(); ++p) {
    const MeasuredPhotograph& photograph = result.photographs[p];
    json["photographs"].push_back({{"photo", observations.photographs[p].seen.name},
                                   {"pose", observations.photographs[p].pose},
                                   {"status", photo_status_name(photograph.status)},
                                   {"words", photograph.words},
                                   {"markers", photograph.residuals.markers},
                                   {"rejected", photograph.residuals.rejected},
                                   {"rms_px", photograph.residuals.rms_px},
                                   {"worst_px", photograph.residuals.worst_px},
                                   {"redundancy", photograph.residuals.redundancy}});
  }
  json["markers"] = Json::array();
  for (std::size_t m = 0; m < adjusted.feature_residuals.size(); ++m) {
    const ResidualSummary& residuals = adjusted.feature_residuals[m];
    json["markers"].push_back({{"id", result.network.features[m].id},
                               {"photographs", residuals.markers},
                               {"rejected", residuals.rejected},
                               {"rms_px", residuals.rms_px},
                               {"worst_px", residuals.worst_px},
                               {"redundancy", residuals.redundancy}});
  }
  const auto lengths = [](const std::vector<MeasuredLength>& all) {
    Json rows = Json::array();
    for (const MeasuredLength& length : all) {
      rows.push_back({{"a", fmt::format("{}.{}", length.known.a.id, length.known.a.corner)},
                      {"b", fmt::format("{}.{}", length.known.b.id, length.known.b.corner)},
                      {"measured", length.measured},
                      {"length_mm", length.length_mm},
                      {"sigma_mm", length.sigma_mm},
                      {"stated_mm", length.known.length_mm}});
    }
    return rows;
  };
  json["bars"] = lengths(result.bars);
  json["checks"] = lengths(result.checks);
  const auto datum = [](const DatumFrame& frame) {
    Json rows = Json::array();
    for (const DatumResidual& residual : frame.residuals) {
      rows.push_back(
          {{"id", residual.point.id},
           {"corner", residual.point.corner},
           {"residual_mm", {residual.residual_mm.x(), residual.residual_mm.y(), residual.residual_mm.z()}},
           {"used", residual.used}});
    }
    return Json{{"ok", frame.ok},
                {"reason", frame.reason},
                {"scale", frame.scale},
                {"notes", frame.notes},
                {"residuals", rows}};
  };
  json["UG"] = datum(result.UG);
  json["LG"] = datum(result.LG);
  json["skipped"] = Json::array();
  for (const SkippedFile& file : listing.skipped)
    json["skipped"].push_back({{"file", file.name}, {"reason", file.reason}});
  json["verdict"] = severity_name(overall_verdict(result));
  json["findings"] = Json::array();
  for (const Finding& finding : result.findings)
    json["findings"].push_back({{"severity", severity_name(finding.severity)},
                                {"cause", finding.cause},
                                {"instruction", finding.instruction}});
  return json_text(json, 1) + "\n";
}

Quality read_quality(const std::filesystem::path& path) {
  try {
    const auto json = Json::parse(read_file(path));
    Quality quality;
    quality.verdict = severity_of(json.at("verdict").get<std::string>());
    quality.sigma0 = json.at("sigma0").get<double>();
    quality.rms_px = json.at("rms_px").get<double>();
    quality.redundancy = json.at("redundancy").get<double>();
    for (const Json& row : json.at("findings"))
      quality.findings.emplace_back(row.at("cause").get<std::string>(),
                                    row.at("instruction").get<std::string>(),
                                    severity_of(row.at("severity").get<std::string>()));
    quality.UG = parse_datum(json.at("UG"));
    quality.LG = parse_datum(json.at("LG"));
    quality.bars = parse_lengths(json.at("bars"));
    quality.checks = parse_lengths(json.at("checks"));
    for (const Json& row : json.at("photographs"))
      quality.photograph_words[row.at("photo").get<std::string>()] = row.at("words").get<std::string>();
    return quality;
  } catch (const Json::exception& error) {
    throw InputError(fmt::format("{}: {}", path.string(), error.what()));
  }
}

}  // namespace hexcal
