#include <algorithm>
#include <cmath>

#include "tools/synthetic/grips.h"
#include "tools/synthetic/tile_renderer.h"

namespace hexcal {

std::vector<StickerView> sticker_views(const Scene& scene, const std::vector<Sticker>& stickers,
                                       const CameraModel& camera, const Rigid3& camera_from_world) {
  constexpr int kGrid = 9;
  std::vector<VisibleSurface> surfaces;
  for (std::size_t i = 0; i < scene.surfaces.size(); ++i) {
    surfaces.emplace_back(scene.surfaces[i], scene.lamp, camera_from_world, static_cast<int>(i));
  }
  std::vector<StickerView> views(stickers.size());
  for (std::size_t i = 0; i < stickers.size(); ++i) {
    const double half = 0.5 * stickers[i].size_mm;
    const Rigid3 camera_from_marker = camera_from_world * scene.surfaces[i].world_from_surface;
    StickerView& view = views[i];
    const Eigen::Vector3d sight = camera_from_marker.translation.normalized();
    const Eigen::Vector3d normal = camera_from_marker.rotation * Eigen::Vector3d::UnitZ();
    view.incidence_rad = std::acos(std::clamp(-sight.dot(normal), -1.0, 1.0));
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector3d corner(k == 1 || k == 2 ? half : -half, k < 2 ? half : -half, 0);
      view.corners_px[k] = camera.project(camera_from_marker * corner).value_or(Eigen::Vector2d(-1e6, -1e6));
    }
    for (std::size_t k = 0; k < 4; ++k) {
      view.side_px += 0.25 * (view.corners_px[k] - view.corners_px[(k + 1) % 4]).norm();
    }
    int seen = 0;
    for (int point = 0; point < kGrid * kGrid; ++point) {
      const Eigen::Vector3d p(half * (2.0 * (point % kGrid) / (kGrid - 1) - 1),
                              half * (2.0 * (point / kGrid) / (kGrid - 1) - 1), 0);
      const Eigen::Vector3d in_camera = camera_from_marker * p;
      const auto px = camera.project(in_camera);
      if (!px || !camera.contains(*px)) continue;
      const Eigen::Vector2d ray = in_camera.head<2>() / in_camera.z();
      const VisibleSurface::Hit own = surfaces[i].hit(ray.x(), ray.y());
      if (own.depth_mm <= 0) continue;
      const bool hidden = std::any_of(surfaces.begin(), surfaces.end(), [&](const VisibleSurface& other) {
        const VisibleSurface::Hit hit = other.hit(ray.x(), ray.y());
        return hit.depth_mm > 0 && hit.depth_mm < own.depth_mm - 1e-6 && other.paint().inside(hit.at);
      });
      seen += hidden ? 0 : 1;
    }
    view.visible_share = static_cast<double>(seen) / (kGrid * kGrid);
  }
  return views;
}

}  // namespace hexcal
