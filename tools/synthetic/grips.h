#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kinematics/platform.h"
#include "photogrammetry/camera/camera_model.h"
#include "tools/synthetic/render.h"

namespace hexcal {

/// Markers on the two grips: two rows of five on the sides of a 12-sided prism that face the camera.
struct MarkerLayout {
  std::string family = "tag36h11";
  double size_mm = 24;
  int first_fixed_id = 0;
  int first_moving_id = 100;
  double position_sigma_mm = 0.5;  ///< glued this far from where they were meant to be
  double angle_sigma_deg = 1.0;
};

/// A marker glued on a grip. Its frame: CONVENTIONS.md, section Markers.
struct Sticker {
  int id = 0;
  bool moving = false;
  double size_mm = 0;
  Rigid3 body_from_marker;  ///< body: UG for the fixed grip, LG for the moving one

  [[nodiscard]] Eigen::Vector3d corner_in_body(int corner) const;
};

/// The test rig: what stands still in UG, what moves with LG, and the stickers on both.
struct Rig {
  std::string family;
  std::vector<Sticker> stickers;
  std::vector<Surface> fixed;   ///< in UG
  std::vector<Surface> moving;  ///< in LG
  PlatformGeometry geometry;    ///< where the legs are drawn
};

[[nodiscard]] Rig make_rig(std::uint64_t seed, const MarkerLayout& layout, const PlatformGeometry& geometry);

/// The rig at a pose; world = UG. The first surfaces are the stickers in their order.
[[nodiscard]] Scene rig_scene(const Rig& rig, const Rigid3& UG_from_LG);

/// A flat marker surface, drawn in the marker's frame.
[[nodiscard]] Surface sticker_surface(const std::string& family, const Sticker& sticker);

/// A marker's pattern as a decal centred on `centre_mm`.
[[nodiscard]] Decal marker_decal(const std::string& family, int id, double size_mm,
                                 const Eigen::Vector2d& centre_mm);

inline constexpr float kInkAlbedo = 0.045F;
inline constexpr float kPaperAlbedo = 0.78F;

/// What one photograph shows of one sticker.
struct StickerView {
  std::array<Eigen::Vector2d, 4> corners_px;
  double visible_share = 0;  ///< of a 9 x 9 grid over its square: in the frame, from the front, not hidden
  double incidence_rad = 0;  ///< between its normal and the line of sight
  double side_px = 0;        ///< mean side
};

[[nodiscard]] std::vector<StickerView> sticker_views(const Scene& scene, const std::vector<Sticker>& stickers,
                                                     const CameraModel& camera,
                                                     const Rigid3& camera_from_world);

}  // namespace hexcal
