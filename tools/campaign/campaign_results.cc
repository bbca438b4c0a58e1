#include <fmt/format.h>

#include <utility>

#include "tools/campaign/measure_campaign.h"
#include "tools/campaign/overlay_image.h"
#include "tools/io/atomic_file.h"
#include "tools/io/colmap_model.h"
#include "tools/io/covariance_file.h"
#include "tools/io/marker_table.h"
#include "tools/io/measured_poses.h"
#include "tools/io/measurement_id.h"
#include "tools/io/photo_table.h"
#include "tools/io/point_cloud_file.h"
#include "tools/io/quality_file.h"
#include "tools/io/residual_file.h"
#include "tools/io/version.h"

namespace hexcal {
namespace fs = std::filesystem;
namespace {

// By what went in and what came out.
std::string name_of(const std::string& origin, const CampaignMeasurement& measurement) {
  std::string content = origin;
  for (const CampaignPhotograph& photograph : measurement.observations.photographs)
    content += fmt::format("{} {}\n", photograph.seen.name, photograph.seen.sha256);
  content += format_pose_table("", pose_records(measurement.result), PoseColumns::measured);
  content += format_pose_covariances("", measurement.result);
  return measurement_id(content);
}

}  // namespace

std::vector<fs::path> write_results(const MeasureRequest& request, const CampaignMeasurement& measurement) {
  const auto& [open, observations, result] = measurement;
  const std::string origin = provenance_line(kVersion, "measure", measurement_inputs(request, open));
  const std::string id = name_of(origin, measurement);
  const std::string head = origin + measurement_line(id);
  std::vector<std::pair<fs::path, std::string>> files;
  const auto write = [&](const fs::path& path, std::string text) {
    files.emplace_back(path, std::move(text));
  };
  if (!request.observations)
    write(open.results / "observations.txt", observations_of_campaign(head, open, observations));
  write(open.results / "poses_covariance.csv", format_pose_covariances(head, result));
  write(open.results / "photos.csv", format_photo_table(head, observations, result));
  write(open.results / "markers.csv", format_marker_table(head, result));
  write(open.results / "markers.ply", format_markers_ply(head, result));
  write(open.results / "markers.pcd", format_markers_pcd(head, result));
  write(open.results / "epochs.csv", format_epoch_table(head, result));
  write(open.results / "residuals.csv", format_residuals(head, observations, result));
  write(open.results / "quality.json", quality_text(observations, result, open.listing, id));
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

}  // namespace hexcal
