#pragma once

#include <cstdint>
#include <vector>

#include "tools/synthetic/render.h"

namespace hexcal {

/// A surface as one camera sees it.
class VisibleSurface {
 public:
  VisibleSurface(const Surface& surface, const Lamp& lamp, const Rigid3& camera_from_world, int index);

  struct Hit {
    double depth_mm = 0;  ///< along the camera's z; 0: the ray misses the surface's plane
    Eigen::Vector2d at;   ///< in the drawing's frame
  };
  [[nodiscard]] Hit hit(double x, double y) const;

  /// False if no ray within the rectangle of normalised coordinates can meet the surface.
  [[nodiscard]] bool may_meet(const Eigen::Vector2d& low, const Eigen::Vector2d& high) const;
  [[nodiscard]] float irradiance(const Eigen::Vector2d& at) const;
  [[nodiscard]] float grain(const Eigen::Vector2d& at) const;
  /// Light of the lamp that the surface mirrors to the camera (Blinn 1977), whatever its paint.
  [[nodiscard]] float sheen(const Eigen::Vector2d& at) const;
  [[nodiscard]] const SurfacePaint& paint() const { return paint_; }
  [[nodiscard]] bool background() const { return background_; }
  [[nodiscard]] int index() const { return index_; }

 private:
  SurfacePaint paint_;
  Eigen::Matrix3d surface_from_camera_;
  Eigen::Vector3d camera_in_surface_;
  std::optional<SheetWarp> warp_;
  Eigen::Vector2d drawn_per_printed_;
  bool everywhere_ = false;               // part of the outline lies behind the camera
  std::vector<Eigen::Vector2d> outline_;  // in normalised coordinates; of a warped surface: points around it
  Eigen::Vector3f irradiance_;            // at the origin, and its slopes
  float gloss_;
  Eigen::Vector3d lamp_in_surface_;
  float grain_;
  double texels_per_mm_;
  bool background_;
  int index_;
};

/// Renders squares of a photograph. Holds the surfaces in view; `tile` may run in several threads.
class TileRenderer {
 public:
  static constexpr int kTilePx = 64;

  TileRenderer(const Scene& scene, const RayLattice& lens, const Rigid3& camera_from_world,
               const OpticsOptions& options, std::uint64_t seed);
  void tile(int x0, int y0, SensorImage& image) const;

 private:
  struct Canvas;
  struct Block;
  struct Seen;
  void trace(Canvas& canvas) const;
  void classify(const Canvas& canvas, const Block& block, const std::vector<int>& candidates, double widen,
                std::vector<Seen>& seen) const;
  void shade(Canvas& canvas) const;
  void fill(Canvas& canvas, int x, int y, const VisibleSurface& surface, float albedo,
            const Eigen::Vector2d& at) const;
  void shade_pixel(Canvas& canvas, int x, int y, const std::vector<int>& candidates,
                   std::vector<Seen>& seen) const;
  void sample_pixel(Canvas& canvas, int x, int y, const std::vector<Seen>& seen) const;
  void blur(Canvas& canvas, SensorImage& image) const;
  void measure_depth(const Canvas& canvas, SensorImage& image) const;

  const RayLattice& lens_;
  std::vector<VisibleSurface> surfaces_;
  std::vector<float> kernel_;  // blur and pixel area over sub-pixels
  int radius_ = 0;             // of the blur, in sub-pixels
  int margin_px_ = 0;
  std::uint64_t seed_;
};

}  // namespace hexcal
