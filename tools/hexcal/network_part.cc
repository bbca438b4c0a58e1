#include "tools/hexcal/network_part.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "kinematics/geometry/covariance.h"
#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/median.h"
#include "kinematics/geometry/pose_pole.h"
#include "tools/io/marker_table.h"
#include "tools/io/photo_table.h"
#include "tools/io/quality_file.h"
#include "tools/io/residual_file.h"
#include "tools/report/axis_ticks.h"
#include "tools/report/markup.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

// Ellipsoids are enlarged until a typical one is this share of the scene.
constexpr double kTypicalEllipsoidShare = 0.08;

std::string point_name(const MarkerPoint& point) {
  return point.corner < 0 ? fmt::format("{}", point.id) : fmt::format("{}.{}", point.id, point.corner);
}

void add_lengths(const std::vector<MeasuredLength>& lengths, const char* kind, NetworkPart& network) {
  for (const MeasuredLength& length : lengths) {
    LengthPart part;
    part.name = fmt::format("{} {} to {}", kind, point_name(length.known.a), point_name(length.known.b));
    if (length.measured) {
      part.measured_mm = length.length_mm;
      part.sigma_mm = length.sigma_mm;
    }
    part.stated_mm = length.known.length_mm;
    network.lengths.push_back(std::move(part));
  }
}

// How a body's frame was found, in words.
std::string datum_words(const DatumFrame& datum) {
  if (!datum.ok) return datum.reason;
  double squares = 0;
  int used = 0;
  int left_out = 0;
  for (const DatumResidual& residual : datum.residuals) {
    if (!residual.used) {
      ++left_out;
      continue;
    }
    squares += residual.residual_mm.squaredNorm();
    ++used;
  }
  std::vector<std::string> words;
  if (used > 0) {
    words.push_back(fmt::format("{} points fit to {} mm rms per axis", used,
                                significant_text(std::sqrt(squares / (3.0 * used)), 2)));
  }
  if (left_out > 0) words.push_back(fmt::format("{} left out", left_out));
  words.insert(words.end(), datum.notes.begin(), datum.notes.end());
  return words.empty() ? "defined by the home pose" : fmt::format("{}", fmt::join(words, "; "));
}

void add_quality(const fs::path& path, NetworkPart& network) {
  Quality quality = read_quality(path);
  network.sigma0 = quality.sigma0;
  network.rms_px = quality.rms_px;
  network.redundancy = quality.redundancy;
  add_lengths(quality.bars, "bar", network);
  add_lengths(quality.checks, "check", network);
  network.datums = {{"UG", datum_words(quality.UG)}, {"LG", datum_words(quality.LG)}};
  for (PhotographPart& photograph : network.photographs) {
    if (photograph.status == "ok") photograph.remarks = quality.photograph_words[photograph.name];
  }
}

void add_residuals(const fs::path& path, NetworkPart& network) {
  const auto residuals = read_residuals(path);
  for (PhotographPart& photograph : network.photographs) {
    const auto found = residuals.find(photograph.name);
    if (found == residuals.end()) continue;
    for (const MarkerResidual& marker : found->second) {
      const bool used = marker.status == "used";
      photograph.outlines.push_back({marker.id, marker.corners_px, used, used ? "" : marker.status});
      for (std::size_t c = 0; c < 4 && marker.placed; ++c)
        photograph.residuals.push_back({marker.corners_px[c], marker.residuals_px[c], used});
    }
  }
}

struct MarkerSet {
  std::vector<SceneMarker> in_UG, in_LG;
};

MarkerSet read_markers(const fs::path& path) {
  std::map<std::pair<std::string, int>, std::map<int, Eigen::Vector3d>> corners;
  for (const MarkerCornerRecord& record : read_marker_table(path))
    corners[{record.frame, record.id}][record.corner] = record.xyz_mm;
  MarkerSet markers;
  for (const auto& [key, points] : corners) {
    SceneMarker marker;
    marker.id = key.second;
    bool complete = true;
    for (std::size_t c = 0; c < 4; ++c) {
      const auto found = points.find(static_cast<int>(c));
      complete = complete && found != points.end();
      if (found != points.end()) marker.corners_mm[c] = found->second;
    }
    if (complete) (key.first == "UG" ? markers.in_UG : markers.in_LG).push_back(marker);
  }
  return markers;
}

// Directions of the frame's corners; without its lens where that cannot be inverted so far out.
std::array<Eigen::Vector3d, 4> corner_directions(const CameraModel& camera) {
  std::array<Eigen::Vector3d, 4> out;
  const std::array<Eigen::Vector2d, 4> corners{{{0, 0},
                                                {camera.width_px - 1, 0},
                                                {camera.width_px - 1, camera.height_px - 1},
                                                {0, camera.height_px - 1}}};
  for (std::size_t c = 0; c < 4; ++c) {
    const auto seen = camera.normalised_from_image(corners[c]);
    const Eigen::Vector2d pinhole((corners[c].x() - camera.cx_px()) / camera.fx_px(),
                                  (corners[c].y() - camera.cy_px()) / camera.fy_px());
    out[c] = seen.value_or(pinhole).homogeneous();
  }
  return out;
}

// A point of the moving body, in home axes relative to O_LG, under the covariance of its pose.
Eigen::Matrix3d point_covariance(const Pose& pose, const Matrix6d& covariance, const Eigen::Vector3d& arm) {
  const Matrix6d motion_by_parameters = pose_parameters_jacobian(pose).inverse();
  Eigen::Matrix<double, 3, 6> by_motion;
  by_motion << Eigen::Matrix3d::Identity(), -skew(arm);
  const Eigen::Matrix<double, 3, 6> by_parameters = by_motion * motion_by_parameters;
  return by_parameters * covariance * by_parameters.transpose();
}

ScenePose scene_pose(const PoseRecord& record, double gd_mm, const MarkerSet& markers,
                     const std::map<std::string, Matrix6d>& covariances, const PlatformGeometry* machine) {
  ScenePose out;
  out.id = record.id;
  if (!record.pose) return out;
  const Rigid3 UG_from_LG = ug_from_lg(*record.pose, gd_mm);
  out.frames.push_back({"LG", UG_from_LG});
  const auto covariance = covariances.find(record.id);
  const bool uncertain = covariance != covariances.end() && covariance->second.trace() > 0 &&
                         roll_and_yaw_are_known(*record.pose, covariance->second);
  const auto add_ellipsoid = [&](const Eigen::Vector3d& point_in_LG) {
    const Eigen::Vector3d arm = UG_from_LG.rotation * point_in_LG;
    out.ellipsoids.push_back({UG_from_LG * point_in_LG,
                              ellipsoid_half_axes(point_covariance(*record.pose, covariance->second, arm))});
  };
  if (uncertain) add_ellipsoid(Eigen::Vector3d::Zero());
  for (const SceneMarker& marker : markers.in_LG) {
    SceneMarker placed{marker.id, {}};
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (std::size_t c = 0; c < 4; ++c) {
      placed.corners_mm[c] = UG_from_LG * marker.corners_mm[c];
      centre += 0.25 * marker.corners_mm[c];
    }
    out.markers.push_back(placed);
    if (uncertain) add_ellipsoid(centre);
  }
  if (machine != nullptr) {
    const Rigid3 UG_from_P = inverse(machine->B_from_UG) * machine->B_from_P(*record.pose);
    for (const Eigen::Vector3d& joint : machine->platform_joints_mm)
      out.platform_joints_mm.push_back(UG_from_P * joint);
  }
  return out;
}

double ellipsoid_scale(const Scene3d& scene) {
  std::vector<double> sizes;
  Eigen::AlignedBox3d box;
  for (const ScenePose& pose : scene.poses) {
    for (const SceneEllipsoid& ellipsoid : pose.ellipsoids) {
      sizes.push_back(ellipsoid.half_axes_mm.colwise().norm().maxCoeff());
      box.extend(ellipsoid.centre_mm);
    }
  }
  const double typical = median(std::move(sizes));
  return typical > 0 ? round_number_below(kTypicalEllipsoidShare * box.diagonal().norm() / typical) : 1;
}

}  // namespace

NetworkPart read_network_part(const Campaign& campaign, const CampaignReport& report,
                              const std::map<std::string, Matrix6d>& covariances,
                              const PlatformGeometry* machine) {
  const fs::path results = campaign.folder / "results";
  NetworkPart network;
  const std::vector<PhotoRecord> photos = read_photo_table(results / "photos.csv");
  for (const PhotoRecord& photo : photos) {
    PhotographPart& part = network.photographs.emplace_back();
    part.pose_id = photo.pose;
    part.name = photo.photo;
    part.status = photo.status;
    part.markers = photo.markers;
    part.rejected = photo.rejected;
    part.rms_px = photo.rms_px;
  }
  add_residuals(results / "residuals.csv", network);
  add_quality(results / "quality.json", network);
  const MarkerSet markers = read_markers(results / "markers.csv");
  network.scene.frames.push_back({"UG", {}});
  network.scene.markers = markers.in_UG;
  if (machine != nullptr) {
    for (const Eigen::Vector3d& joint : machine->base_joints_mm)
      network.scene.base_joints_mm.push_back(inverse(machine->B_from_UG) * joint);
  }
  const double gd_mm = campaign.lg ? campaign.lg->gd_mm : 0;
  for (const PoseRecord& record : report.poses)
    network.scene.poses.push_back(scene_pose(record, gd_mm, markers, covariances, machine));
  if (report.cameras.empty()) return network;
  const CameraModel& camera = report.cameras.front().camera.model;
  for (PhotographPart& photograph : network.photographs)
    photograph.size_px = {camera.width_px, camera.height_px};
  const auto directions = corner_directions(camera);
  for (const PhotoRecord& photo : photos) {
    const auto pose = std::ranges::find(network.scene.poses, photo.pose, &ScenePose::id);
    if (pose == network.scene.poses.end() || !photo.UG_from_camera) continue;
    pose->cameras.push_back({fs::path(photo.photo).stem().string(), *photo.UG_from_camera, directions});
  }
  network.scene.ellipsoid_scale = ellipsoid_scale(network.scene);
  return network;
}

}  // namespace hexcal
