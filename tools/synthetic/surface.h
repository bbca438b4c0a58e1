#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "kinematics/geometry/rigid3.h"

namespace hexcal {

/// A printed pattern on a surface: a grid of cells, or a round dot filling its single cell.
struct Decal {
  Eigen::Vector2d top_left_mm;  ///< corner of the first cell; rows go down (-y), columns right (+x)
  Eigen::Vector2d cell_mm;      ///< width and height of a cell
  int columns = 1;
  int rows = 1;
  bool round = false;
  std::vector<float> albedo;  ///< columns x rows, row by row; negative: see-through
};

/// Height of a warped sheet: z = x_mm (1 - (x/hx)^2) + y_mm (1 - (y/hy)^2), zero on the corners.
struct SheetWarp {
  Eigen::Vector2d height_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d half_size_mm = Eigen::Vector2d::Ones();

  [[nodiscard]] double z(const Eigen::Vector2d& p) const {
    return height_mm.x() * (1 - p.x() * p.x() / (half_size_mm.x() * half_size_mm.x())) +
           height_mm.y() * (1 - p.y() * p.y() / (half_size_mm.y() * half_size_mm.y()));
  }
};

/// A convex, flat (or slightly warped) piece of the scene, seen from the side its z axis points to.
struct Surface {
  Rigid3 world_from_surface;
  std::vector<Eigen::Vector2d> outline_mm;  ///< convex, counter-clockwise seen from +z
  float albedo = 0.5F;
  std::array<float, 3> tint{1, 1, 1};  ///< colour, about 1
  float grain = 0;                     ///< relative amplitude of the surface's texture
  double grain_mm = 1;                 ///< size of one texel of that texture
  bool background = false;             ///< its edges need no exact sampling
  std::vector<Decal> decals;           ///< a later one lies over an earlier one
  float gloss = 0;                     ///< of the lamp's light, mirrored in the middle of the highlight
  double ink_spread_mm = 0;            ///< the darker of two neighbours reaches this far over their border
  Eigen::Vector2d print_scale{1, 1};   ///< the print is this much larger than drawn, about the origin
  std::optional<SheetWarp> warp;

  /// Where a point of the drawing lies in the surface's frame: print scale, then warp.
  [[nodiscard]] Eigen::Vector3d printed_point(const Eigen::Vector2d& drawn_mm) const;
};

[[nodiscard]] std::vector<Eigen::Vector2d> rectangle_outline(double half_width_mm, double half_height_mm);

/// What a small rectangle of a surface looks like.
enum class Cover { outside, partly, uniform, mixed };  ///< the last two: wholly inside the outline

struct Footprint {
  Cover cover = Cover::outside;
  float albedo = 0;  ///< if uniform
};

/// Fast look-up of a surface's paint.
class SurfacePaint {
 public:
  explicit SurfacePaint(const Surface& surface);

  /// `low` and `high` in mm of the drawing's frame.
  [[nodiscard]] Footprint footprint(const Eigen::Vector2d& low, const Eigen::Vector2d& high) const;
  [[nodiscard]] bool inside(const Eigen::Vector2d& p) const;
  /// Albedo at a point inside.
  [[nodiscard]] float albedo(const Eigen::Vector2d& p) const;

 private:
  struct Bin {
    std::vector<int> decals;
  };
  [[nodiscard]] int bin_index(double coordinate, int axis) const;
  [[nodiscard]] float drawn_albedo(const Eigen::Vector2d& p) const;
  /// Without the outline and without spread of ink.
  [[nodiscard]] Footprint drawn_footprint(const Eigen::Vector2d& low, const Eigen::Vector2d& high) const;

  float base_albedo_;
  float darkest_;
  double ink_spread_mm_;
  std::vector<Eigen::Vector3d> edges_;  ///< inside where a x + b y + c >= 0
  std::vector<Decal> decals_;
  Eigen::Vector2d low_{0, 0}, high_{0, 0};
  Eigen::Vector2d bins_per_mm_{0, 0};
  std::vector<Bin> bins_;
};

}  // namespace hexcal
