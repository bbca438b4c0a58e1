#include "tools/io/colmap_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>

namespace hexcal {
namespace {

// COLMAP puts the first pixel's centre at (0.5, 0.5).
constexpr double kHalf = 0.5;

std::string camera_line(std::size_t index, const CameraModel& camera) {
  const auto& p = camera.parameters;
  const std::string pinhole = fmt::format("{:.9g} {:.9g} {:.9g} {:.9g}", camera.fx_px(), camera.fy_px(),
                                          camera.cx_px() + kHalf, camera.cy_px() + kHalf);
  const std::string size = fmt::format("{} {}", camera.width_px, camera.height_px);
  if (camera.lens != LensModel::brown) return fmt::format("{} PINHOLE {} {}\n", index + 1, size, pinhole);
  return fmt::format("{} FULL_OPENCV {} {} {:.9g} {:.9g} {:.9g} {:.9g} {:.9g} 0 0 0\n", index + 1, size,
                     pinhole, p[4], p[5], p[6], p[7], p[8]);
}

// A marker's corner at one epoch; fixed markers are the same point at all epochs.
struct ModelPoint {
  int marker = 0;
  int corner = 0;
  int epoch = -1;
  auto operator<=>(const ModelPoint&) const = default;
};

struct Track {
  std::size_t number = 0;
  std::vector<std::pair<std::size_t, std::size_t>> places;  // (image id, index of its 2D point)
};

// COLMAP's PINHOLE has no distortion, so what goes with it has none either.
std::optional<Eigen::Vector2d> model_px(const CameraModel& camera, const Eigen::Vector2d& px) {
  const Eigen::Vector2d half = Eigen::Vector2d::Constant(kHalf);
  if (camera.lens == LensModel::brown) return px + half;
  const auto normalised = camera.normalised_from_image(px);
  if (!normalised) return std::nullopt;
  return Eigen::Vector2d(camera.fx_px() * normalised->x() + camera.cx_px(),
                         camera.fy_px() * normalised->y() + camera.cy_px()) +
         half;
}

class ColmapModel {
 public:
  ColmapModel(const CampaignObservations& observations, const CampaignResult& result)
      : observations_(observations), result_(result) {}

  std::vector<std::pair<std::string, std::string>> files() {
    const NetworkGeometry& geometry = result_.adjusted.geometry;
    std::string cameras =
        "# Camera list: CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]; PINHOLE: without the lens's distortion, which "
        "this "
        "list of models has not\n";
    for (std::size_t c = 0; c < geometry.cameras.size(); ++c) cameras += camera_line(c, geometry.cameras[c]);
    std::string images =
        "# Image list: IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then its points: X Y POINT3D_ID ...\n";
    for (std::size_t p = 0; p < result_.photographs.size(); ++p) {
      if (result_.photographs[p].UG_from_camera) images += image_lines(p);
    }
    std::string points = "# 3D point list: POINT3D_ID X Y Z R G B ERROR TRACK[] as (IMAGE_ID, POINT2D_IDX)\n";
    for (const auto& [point, track] : tracks_) points += point_line(point, track);
    return {{"cameras.txt", cameras}, {"images.txt", images}, {"points3D.txt", points}};
  }

 private:
  std::string image_lines(std::size_t p) {
    const NetworkPhoto& photo = result_.network.photos[p];
    const Rigid3 motion = inverse(*result_.photographs[p].UG_from_camera);
    const auto& q = motion.rotation;
    std::string lines =
        fmt::format("{} {:.12g} {:.12g} {:.12g} {:.12g} {:.9g} {:.9g} {:.9g} {} {}\n", p + 1, q.w(), q.x(),
                    q.y(), q.z(), motion.translation.x(), motion.translation.y(), motion.translation.z(),
                    photo.camera + 1, observations_.photographs[p].seen.name);
    std::size_t index = 0;
    for (const Sighting& sighting : result_.adjusted.sightings) {
      if (sighting.photo != static_cast<int>(p) || sighting.status != SightingStatus::used) continue;
      const bool moving =
          result_.network.features[static_cast<std::size_t>(sighting.feature)].body == kMovingBody;
      if (moving && !result_.poses[static_cast<std::size_t>(photo.epoch)].pose) continue;
      for (int corner = 0; corner < 4; ++corner) {
        const auto px = model_px(result_.adjusted.geometry.cameras[static_cast<std::size_t>(photo.camera)],
                                 sighting.px.segment<2>(2 * corner));
        if (!px) continue;
        Track& track = tracks_[{sighting.feature, corner, moving ? photo.epoch : -1}];
        if (track.places.empty()) track.number = tracks_.size();
        track.places.emplace_back(p + 1, index);
        lines += fmt::format("{}{:.6f} {:.6f} {}", index == 0 ? "" : " ", px->x(), px->y(), track.number);
        ++index;
      }
    }
    return lines + "\n";
  }

  std::string point_line(const ModelPoint& point, const Track& track) const {
    const auto marker = static_cast<std::size_t>(point.marker);
    const auto measured =
        std::find_if(result_.points.begin(), result_.points.end(), [&](const MeasuredPoint& one) {
          return one.point.id == result_.network.features[marker].id && one.point.corner == point.corner;
        });
    if (measured == result_.points.end()) return "";
    Eigen::Vector3d at = measured->xyz_mm;
    if (point.epoch >= 0) {
      at = ug_from_lg(*result_.poses[static_cast<std::size_t>(point.epoch)].pose, result_.gd_mm) * at;
    }
    std::string line = fmt::format("{} {:.9g} {:.9g} {:.9g} {} {:.6g}", track.number, at.x(), at.y(), at.z(),
                                   point.epoch >= 0 ? "210 110 40" : "60 100 200",
                                   result_.adjusted.feature_residuals[marker].rms_px);
    for (const auto& [image, index] : track.places) line += fmt::format(" {} {}", image, index);
    return line + "\n";
  }

  const CampaignObservations& observations_;
  const CampaignResult& result_;
  std::map<ModelPoint, Track> tracks_;
};

}  // namespace

std::vector<std::pair<std::string, std::string>> format_colmap_model(const CampaignObservations& observations,
                                                                     const CampaignResult& result) {
  return ColmapModel(observations, result).files();
}

}  // namespace hexcal
