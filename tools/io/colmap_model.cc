#include "tools/io/colmap_model.h"

#include <fmt/format.h>

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

}  // namespace

std::vector<std::pair<std::string, std::string>> format_colmap_model(const CampaignObservations& observations,
                                                                     const CampaignResult& result) {
  const NetworkGeometry& geometry = result.adjusted.geometry;
  std::string cameras = "# Camera list: CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n";
  for (std::size_t c = 0; c < geometry.cameras.size(); ++c) cameras += camera_line(c, geometry.cameras[c]);

  std::string images = "# Image list: IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then its points\n";
  for (std::size_t p = 0; p < result.photographs.size(); ++p) {
    if (!geometry.has_photo[p]) continue;
    const Rigid3& motion = geometry.camera_from_fixed[p];
    const auto& q = motion.rotation;
    images +=
        fmt::format("{} {:.12g} {:.12g} {:.12g} {:.12g} {:.9g} {:.9g} {:.9g} {} {}\n\n", p + 1, q.w(), q.x(),
                    q.y(), q.z(), motion.translation.x(), motion.translation.y(), motion.translation.z(),
                    result.network.photos[p].camera + 1, observations.photographs[p].seen.name);
  }

  std::string points = "# 3D point list: POINT3D_ID X Y Z R G B ERROR TRACK[]\n";
  std::size_t epoch = 0;
  while (epoch < geometry.has_epoch.size() && !geometry.has_epoch[epoch]) ++epoch;
  for (std::size_t m = 0; m < result.network.markers.size(); ++m) {
    if (!geometry.has_marker[m]) continue;
    const bool moving = result.network.markers[m].body == Body::moving;
    if (moving && epoch == geometry.has_epoch.size()) continue;
    const Rigid3 fixed_from_body = moving ? geometry.fixed_from_moving[epoch] : Rigid3();
    const auto corners = marker_corners_in_body(result.network, geometry, static_cast<int>(m));
    for (int c = 0; c < 4; ++c) {
      const Eigen::Vector3d at = fixed_from_body * corners.col(c);
      points += fmt::format("{} {:.9g} {:.9g} {:.9g} {} {:.6g}\n", 4 * m + static_cast<std::size_t>(c) + 1,
                            at.x(), at.y(), at.z(), moving ? "210 110 40" : "60 100 200",
                            result.adjusted.marker_residuals[m].rms_px);
    }
  }
  return {{"cameras.txt", cameras}, {"images.txt", images}, {"points3D.txt", points}};
}

}  // namespace hexcal
