#include "tools/hexcal/network_part.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "kinematics/geometry/covariance.h"
#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/median.h"
#include "tools/io/atomic_file.h"
#include "tools/io/csv_table.h"
#include "tools/io/residual_file.h"
#include "tools/report/axis_ticks.h"
#include "tools/report/markup.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// Ellipsoids are enlarged until a typical one is this share of the scene.
constexpr double kTypicalEllipsoidShare = 0.08;

Json read_quality(const fs::path& path) {
  try {
    return Json::parse(read_file(path));
  } catch (const Json::exception& error) {
    throw InputError(fmt::format("{}: {}", path.string(), error.what()));
  }
}

std::string point_name(const Json& point) {
  const std::string name = point.get<std::string>();
  return name.ends_with(".-1") ? name.substr(0, name.size() - 3) : name;
}

void add_lengths(const Json& rows, const char* kind, NetworkPart& network) {
  for (const Json& row : rows) {
    LengthPart length;
    length.name = fmt::format("{} {} to {}", kind, point_name(row.at("a")), point_name(row.at("b")));
    if (row.at("measured").get<bool>()) {
      length.measured_mm = row.at("length_mm").get<double>();
      length.sigma_mm = row.at("sigma_mm").get<double>();
    }
    length.stated_mm = row.at("stated_mm").get<double>();
    network.lengths.push_back(std::move(length));
  }
}

// How a body's frame was found, in words.
std::string datum_words(const Json& datum) {
  if (!datum.at("ok").get<bool>()) return datum.at("reason").get<std::string>();
  double squares = 0;
  int used = 0;
  int left_out = 0;
  for (const Json& residual : datum.at("residuals")) {
    if (!residual.at("used").get<bool>()) {
      ++left_out;
      continue;
    }
    for (const Json& value : residual.at("residual_mm")) squares += std::pow(value.get<double>(), 2);
    ++used;
  }
  std::vector<std::string> words;
  if (used > 0) {
    words.push_back(fmt::format("{} points fit to {} mm rms per axis", used,
                                significant_text(std::sqrt(squares / (3.0 * used)), 2)));
  }
  if (left_out > 0) words.push_back(fmt::format("{} left out", left_out));
  for (const Json& note : datum.at("notes")) words.push_back(note.get<std::string>());
  return words.empty() ? "defined by the home pose" : fmt::format("{}", fmt::join(words, "; "));
}

void add_quality(const fs::path& path, NetworkPart& network) {
  const Json quality = read_quality(path);
  try {
    network.sigma0 = quality.at("sigma0").get<double>();
    network.rms_px = quality.at("rms_px").get<double>();
    network.redundancy = quality.at("redundancy").get<double>();
    network.warnings = quality.at("warnings").get<std::vector<std::string>>();
    add_lengths(quality.at("bars"), "bar", network);
    add_lengths(quality.at("checks"), "check", network);
    for (const char* frame : {"UG", "LG"}) network.datums.emplace_back(frame, datum_words(quality.at(frame)));
    std::map<std::string, std::string> words;
    for (const Json& row : quality.at("photographs")) {
      words[row.at("photo").get<std::string>()] = row.at("words").get<std::string>();
    }
    for (PhotographPart& photograph : network.photographs) {
      if (photograph.status == "ok") photograph.remarks = words[photograph.name];
    }
  } catch (const Json::exception& error) {
    throw InputError(fmt::format("{}: {}", path.string(), error.what()));
  }
}

struct Station {
  std::string photograph, pose;
  Rigid3 UG_from_camera;
};

std::vector<Station> read_photographs(const fs::path& path, NetworkPart& network) {
  const CsvTable table = CsvTable::read(path);
  std::vector<Station> stations;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    PhotographPart photograph;
    photograph.name = table.text(row, "photo");
    photograph.pose_id = table.text(row, "pose");
    photograph.status = table.text(row, "status");
    photograph.markers = table.integer(row, "markers");
    photograph.rejected = table.integer(row, "rejected");
    photograph.rms_px = table.number(row, "rms_px");
    if (table.optional_number(row, kPoseColumns[0])) {
      Vector6d v;
      for (std::size_t i = 0; i < 6; ++i)
        v[static_cast<Eigen::Index>(i)] = table.number(row, kPoseColumns[i]) * pose_column_unit(i);
      stations.push_back({photograph.name, photograph.pose_id, home_from_lg(Pose::from_vector(v))});
    }
    network.photographs.push_back(std::move(photograph));
  }
  return stations;
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
  const CsvTable table = CsvTable::read(path);
  std::map<std::pair<std::string, int>, std::map<int, Eigen::Vector3d>> corners;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    corners[{table.text(row, "frame"), table.integer(row, "id")}][table.integer(row, "corner")] = {
        table.number(row, "x_mm"), table.number(row, "y_mm"), table.number(row, "z_mm")};
  }
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
  const bool uncertain = covariance != covariances.end() && covariance->second.trace() > 0;
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
  const std::vector<Station> stations = read_photographs(results / "photos.csv", network);
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
  for (const Station& station : stations) {
    const auto pose = std::ranges::find(network.scene.poses, station.pose, &ScenePose::id);
    if (pose == network.scene.poses.end()) continue;
    pose->cameras.push_back(
        {fs::path(station.photograph).stem().string(), station.UG_from_camera, directions});
  }
  network.scene.ellipsoid_scale = ellipsoid_scale(network.scene);
  return network;
}

}  // namespace hexcal
