#pragma once

#include <array>
#include <string>

#include "tools/report/canvas.h"
#include "tools/report/scene.h"

namespace hexcal {

/// What the view has to hold: bodies and frames, not the cameras, which may stand far off.
struct SceneBounds {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius = 1;
  double far = 1;  ///< from the centre to the farthest camera, at most kFarthest radii
};
[[nodiscard]] SceneBounds scene_bounds(const Scene3d& scene);

/// The pose shown first: one that has an error of its own, where there is one.
[[nodiscard]] std::size_t first_shown_pose(const Scene3d& scene);

/// How deep camera pyramids are drawn, mm.
[[nodiscard]] double frustum_depth(const SceneBounds& bounds);
[[nodiscard]] std::array<Eigen::Vector3d, 4> frustum_corners(const SceneCamera& camera, double depth_mm);

/// Parallel projection of pose `index` from the front, turned to the right and seen from above.
void draw_scene_still(const Scene3d& scene, std::size_t index, const Eigen::Vector2d& size, Canvas& canvas);
[[nodiscard]] std::string scene_still_svg(const Scene3d& scene);

}  // namespace hexcal
