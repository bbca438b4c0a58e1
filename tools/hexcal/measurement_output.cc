#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tools/hexcal/campaign_measurement.h"
#include "tools/hexcal/command.h"
#include "tools/hexcal/overlay_image.h"
#include "tools/hexcal/terminal.h"
#include "tools/hexcal/version.h"
#include "tools/io/atomic_file.h"
#include "tools/io/colmap_model.h"
#include "tools/io/covariance_file.h"
#include "tools/io/json_text.h"
#include "tools/io/observations_file.h"
#include "tools/io/point_cloud_file.h"
#include "tools/io/pose_table.h"
#include "tools/io/residual_file.h"

namespace hexcal {
namespace fs = std::filesystem;
namespace {

Vector6d sigmas(const MeasuredPose& pose) { return pose.covariance.diagonal().cwiseMax(0.0).cwiseSqrt(); }

std::string status_text(const MeasuredPose& pose) {
  if (pose.status == PoseStatus::ok) return "ok";
  return pose.words.empty() ? std::string(pose_status_name(pose.status))
                            : fmt::format("{}: {}", pose_status_name(pose.status), pose.words);
}

std::vector<PoseRecord> pose_records(const CampaignResult& result) {
  std::vector<PoseRecord> records;
  for (const MeasuredPose& pose : result.poses) {
    PoseRecord record;
    record.id = pose.id;
    record.status = status_text(pose);
    record.pose = pose.pose;
    if (pose.pose) record.sigma = sigmas(pose);
    record.images = pose.images;
    record.markers = pose.markers;
    if (pose.pose) record.rms_px = pose.rms_px;
    if (pose.status == PoseStatus::ok) record.remarks = pose.words;
    records.push_back(std::move(record));
  }
  return records;
}

std::string length_line(const char* kind, const MeasuredLength& length) {
  const auto name = [](const MarkerPoint& point) {
    return point.corner < 0 ? fmt::format("{}", point.id) : fmt::format("{}.{}", point.id, point.corner);
  };
  if (!length.measured)
    return fmt::format("{} {}-{}: not measured\n", kind, name(length.known.a), name(length.known.b));
  return fmt::format("{} {}-{}: measured {:.4f} mm (sigma {:.4f}), stated {:.4f}, difference {:+.4f} mm\n",
                     kind, name(length.known.a), name(length.known.b), length.length_mm, length.sigma_mm,
                     length.known.length_mm, length.length_mm - length.known.length_mm);
}

}  // namespace

std::vector<fs::path> measurement_inputs(const MeasureRequest& request, const OpenCampaign& open) {
  std::vector<fs::path> inputs{open.campaign.file};
  for (const CampaignCamera& camera : open.campaign.cameras) inputs.push_back(camera.file);
  for (const auto* rule : {&open.campaign.ug, &open.campaign.lg}) {
    if (*rule && (*rule)->nominal_file) inputs.push_back(*(*rule)->nominal_file);
  }
  if (request.observations) inputs.push_back(*request.observations);
  return inputs;
}

std::vector<fs::path> write_results(const MeasureRequest& request, const OpenCampaign& open,
                                    const CampaignObservations& observations, const CampaignResult& result) {
  const std::string head = provenance_line(kVersion, "measure", measurement_inputs(request, open));
  std::vector<std::pair<fs::path, std::string>> files;
  const auto write = [&](const fs::path& path, std::string text) {
    files.emplace_back(path, std::move(text));
  };
  DetectionSet set{open.campaign.family, open.camera_sha256.size() == 1 ? open.camera_sha256[0] : "", {}};
  for (const CampaignPhotograph& photograph : observations.photographs) {
    set.photographs.push_back(photograph.seen);
    // With the pose's folder, so that `--observations` can read it back.
    if (fs::path(photograph.seen.name).parent_path().filename().string() != photograph.pose) {
      set.photographs.back().name =
          photograph.pose + "/" + fs::path(photograph.seen.name).filename().string();
    }
  }
  if (!request.observations) write(open.results / "observations.txt", observations_text(set, head));
  write(open.results / "poses_covariance.csv", format_pose_covariances(head, result));
  write(open.results / "photos.csv", format_photo_poses(head, observations, result));
  write(open.results / "markers.csv", format_marker_points(head, result));
  write(open.results / "markers.ply", format_markers_ply(head, result));
  write(open.results / "markers.pcd", format_markers_pcd(head, result));
  write(open.results / "epochs.csv", format_epoch_table(head, result));
  write(open.results / "residuals.csv", format_residuals(head, observations, result));
  write(open.results / "quality.json", measurement_json(observations, result, open.listing));
  if (request.colmap) {
    for (const auto& [name, text] : format_colmap_model(observations, result)) {
      write(open.results / "colmap" / name, text);
    }
  }
  // Last: whoever waits for poses.csv finds the rest.
  write(open.poses_csv, format_pose_table(head, pose_records(result), PoseColumns::measured));
  write_files_atomically(files);
  std::vector<fs::path> written;
  for (const auto& [path, text] : files) written.push_back(path);
  if (request.overlays && !request.observations) {
    for (std::size_t p = 0; p < observations.photographs.size(); ++p) {
      if (const auto path = write_overlay(open, observations, result, p)) written.push_back(*path);
    }
  }
  return written;
}

std::string measurement_text(const CampaignObservations& observations, const CampaignResult& result,
                             const ImageListing& listing) {
  std::string out;
  TextTable table({"pose", "x_mm", "y_mm", "z_mm", "roll_deg", "pitch_deg", "yaw_deg", "sigma_um",
                   "sigma_mdeg", "photos", "markers", "rms_px", "status"});
  table.align_left(12);
  int bad = 0;
  int suspects = 0;
  for (const MeasuredPose& pose : result.poses) {
    std::vector<std::string> cells{pose.id};
    const bool ok = pose.status == PoseStatus::ok;
    for (int i = 0; i < 6; ++i) {
      const double unit = i < 3 ? 1.0 : kRadPerDeg;
      cells.push_back(pose.pose ? fmt::format("{:.4f}", pose.pose->vector()[i] / unit) : "");
    }
    if (pose.pose) {
      const Vector6d sigma = sigmas(pose);
      cells.push_back(fmt::format("{:.2f}", sigma.head<3>().maxCoeff() * 1e3));
      cells.push_back(fmt::format("{:.2f}", sigma.tail<3>().maxCoeff() * kDegPerRad * 1e3));
    } else {
      cells.insert(cells.end(), {"", ""});
    }
    cells.push_back(fmt::format("{}", pose.images));
    cells.push_back(fmt::format("{}", pose.markers));
    cells.push_back(pose.pose ? fmt::format("{:.4f}", pose.rms_px) : "");
    std::string words = status_text(pose);
    if (ok && !pose.words.empty()) words += " (" + pose.words + ")";
    cells.push_back(words);
    const bool doubtful = pose.status == PoseStatus::suspect || (ok && !pose.words.empty());
    table.add_row(std::move(cells), doubtful ? Colour::warning : ok ? Colour::plain : Colour::bad);
    bad += ok ? 0 : 1;
    suspects += pose.status == PoseStatus::suspect ? 1 : 0;
  }
  if (!result.poses.empty()) out += table.text();
  const AdjustmentResult& adjusted = result.adjusted;
  int used = 0;
  std::size_t worst = 0;
  for (std::size_t p = 0; p < result.photographs.size(); ++p) {
    const MeasuredPhotograph& photograph = result.photographs[p];
    if (is_used(photograph.status)) ++used;
    if (photograph.residuals.worst_px > result.photographs[worst].residuals.worst_px) worst = p;
    if (photograph.status != PhotoStatus::ok) {
      out += fmt::format("photograph {}: {}: {}\n", observations.photographs[p].seen.name,
                         photo_status_name(photograph.status), photograph.words);
    } else if (!photograph.words.empty()) {
      out += fmt::format("photograph {}: {}\n", observations.photographs[p].seen.name, photograph.words);
    }
  }
  for (const SkippedFile& file : listing.skipped)
    out += fmt::format("not used: {}: {}\n", file.name, file.reason);
  for (const MeasuredLength& bar : result.bars) out += length_line("bar", bar);
  for (const MeasuredLength& check : result.checks) out += length_line("check", check);
  for (const std::string& warning : result.warnings) out += fmt::format("warning: {}\n", warning);
  out += fmt::format("{} of {} poses{}, {} of {} photographs",
                     result.poses.size() - static_cast<std::size_t>(bad), result.poses.size(),
                     suspects > 0 ? fmt::format(" ({} more are suspect)", suspects) : "", used,
                     result.photographs.size());
  if (!result.photographs.empty() && adjusted.redundancy_total > 0) {
    out += fmt::format(
        "; sigma0 {:.3f} at redundancy {:.0f}, rms {:.4f} px, worst corner {:.4f} px in {}; markers {}",
        adjusted.sigma0, adjusted.redundancy_total, adjusted.rms_px,
        result.photographs[worst].residuals.worst_px, observations.photographs[worst].seen.name,
        adjusted.shape_free ? "with free corners" : "as rigid squares");
  }
  return out + "\n";
}

std::string measurement_json(const CampaignObservations& observations, const CampaignResult& result,
                             const ImageListing& listing) {
  using Json = nlohmann::ordered_json;
  const AdjustmentResult& adjusted = result.adjusted;
  Json json;
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
      Vector6d v = pose.pose->vector();
      Vector6d s = sigmas(pose);
      v.tail<3>() *= kDegPerRad;
      s.tail<3>() *= kDegPerRad;
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
  for (std::size_t m = 0; m < adjusted.marker_residuals.size(); ++m) {
    const ResidualSummary& residuals = adjusted.marker_residuals[m];
    json["markers"].push_back({{"id", result.network.markers[m].id},
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
  json["warnings"] = result.warnings;
  return json_text(json, 1) + "\n";
}

int measurement_exit_code(const CampaignResult& result) {
  for (const MeasuredPose& pose : result.poses) {
    // In a plain photogrammetry project folders are no poses.
    if (pose.status != PoseStatus::ok && result.has_moving) return kSomeFailed;
  }
  for (const MeasuredPhotograph& photograph : result.photographs) {
    if (photograph.status != PhotoStatus::ok) return kSomeFailed;
  }
  return result.adjusted.status == AdjustmentStatus::ok ? kDone : kSomeFailed;
}

}  // namespace hexcal
