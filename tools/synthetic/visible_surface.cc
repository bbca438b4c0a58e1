#include <algorithm>
#include <cmath>

#include "tools/synthetic/random_source.h"
#include "tools/synthetic/tile_renderer.h"

namespace hexcal {
namespace {

constexpr int kTexels = 1024;

// A periodic random texture of several octaves, mean 0, about +-1.
const std::vector<float>& grain_texture() {
  static const std::vector<float> texture = [] {
    std::vector<float> sum(static_cast<std::size_t>(kTexels) * kTexels, 0.0F);
    for (int octave = 0; octave < 8; ++octave) {
      const int cells = 8 << octave;
      const double weight = std::pow(0.75, octave) * 0.5;
      const auto value = [&](int x, int y) {
        const auto key = static_cast<std::uint64_t>(((octave * cells) + y % cells) * cells + x % cells);
        return static_cast<double>(mixed_bits(key ^ 0xC0FFEEULL) >> 40) * 0x1.0p-23 - 1.0;
      };
      for (int y = 0; y < kTexels; ++y) {
        const double fy = static_cast<double>(y) * cells / kTexels;
        const int iy = static_cast<int>(fy);
        for (int x = 0; x < kTexels; ++x) {
          const double fx = static_cast<double>(x) * cells / kTexels;
          const int ix = static_cast<int>(fx);
          const double u = fx - ix;
          const double v = fy - iy;
          const double top = (1 - u) * value(ix, iy) + u * value(ix + 1, iy);
          const double bottom = (1 - u) * value(ix, iy + 1) + u * value(ix + 1, iy + 1);
          sum[static_cast<std::size_t>(y * kTexels + x)] +=
              static_cast<float>(weight * ((1 - v) * top + v * bottom));
        }
      }
    }
    return sum;
  }();
  return texture;
}

}  // namespace

VisibleSurface::VisibleSurface(const Surface& surface, const Lamp& lamp, const Rigid3& camera_from_world,
                               int index)
    : paint_(surface),
      warp_(surface.warp),
      drawn_per_printed_(surface.print_scale.cwiseInverse()),
      gloss_(surface.gloss * static_cast<float>(lamp.strength)),
      grain_(surface.grain),
      texels_per_mm_(1 / surface.grain_mm),
      background_(surface.background),
      index_(index) {
  const Rigid3 camera_from_surface = camera_from_world * surface.world_from_surface;
  const Rigid3 surface_from_camera = inverse(camera_from_surface);
  surface_from_camera_ = surface_from_camera.rotation_matrix();
  camera_in_surface_ = surface_from_camera.translation;
  // A warped surface lies within the block of its outline and its heights.
  std::vector<double> heights{0};
  if (warp_) {
    heights = {warp_->height_mm.cwiseMin(0).sum(), warp_->height_mm.cwiseMax(0).sum()};
    for (const Eigen::Vector2d& corner : surface.outline_mm) {
      const double z = surface.printed_point(corner).z();
      heights = {std::min(heights[0], z), std::max(heights[1], z)};
    }
  }
  for (const Eigen::Vector2d& corner : surface.outline_mm) {
    for (const double height : heights) {
      Eigen::Vector3d in_surface = surface.printed_point(corner);
      in_surface.z() = height;
      const Eigen::Vector3d p = camera_from_surface * in_surface;
      if (p.z() < 1.0) {
        everywhere_ = true;
      } else {
        outline_.emplace_back(p.head<2>() / p.z());
      }
    }
  }
  lamp_in_surface_ = surface.world_from_surface.rotation.conjugate() * lamp.towards.normalized();
  const Eigen::Vector3d normal = surface.world_from_surface.rotation * Eigen::Vector3d::UnitZ();
  const double base = lamp.ambient + lamp.strength * std::max(0.0, normal.dot(lamp.towards.normalized()));
  const auto slope = [&](const Eigen::Vector3d& axis) {
    return base * lamp.gradient_per_mm.dot(surface.world_from_surface.rotation * axis);
  };
  const double origin = base * (1 + lamp.gradient_per_mm.dot(surface.world_from_surface.translation));
  irradiance_ =
      Eigen::Vector3d(origin, slope(Eigen::Vector3d::UnitX()), slope(Eigen::Vector3d::UnitY())).cast<float>();
}

VisibleSurface::Hit VisibleSurface::hit(double x, double y) const {
  const Eigen::Vector3d way = surface_from_camera_ * Eigen::Vector3d(x, y, 1.0);
  if (way.z() >= 0 || camera_in_surface_.z() <= 0) return {};  // seen from behind
  double depth = -camera_in_surface_.z() / way.z();
  Eigen::Vector2d p = camera_in_surface_.head<2>() + depth * way.head<2>();
  if (warp_) {
    for (int iteration = 0; iteration < 8; ++iteration) {
      const double next = (warp_->z(p) - camera_in_surface_.z()) / way.z();
      const double change = next - depth;
      depth = next;
      p = camera_in_surface_.head<2>() + depth * way.head<2>();
      if (std::abs(change) < 1e-9) break;
    }
  }
  return {depth, p.cwiseProduct(drawn_per_printed_)};
}

bool VisibleSurface::may_meet(const Eigen::Vector2d& low, const Eigen::Vector2d& high) const {
  if (camera_in_surface_.z() <= 0) return false;
  if (everywhere_) return true;
  // The outline is convex in the image as well: look for a side, of it or of the rectangle, that separates.
  Eigen::Vector2d outline_low = outline_.front();
  Eigen::Vector2d outline_high = outline_.front();
  for (const Eigen::Vector2d& p : outline_) {
    outline_low = outline_low.cwiseMin(p);
    outline_high = outline_high.cwiseMax(p);
  }
  if ((outline_low.array() > high.array()).any() || (outline_high.array() < low.array()).any()) return false;
  if (warp_) return true;
  for (std::size_t i = 0; i < outline_.size(); ++i) {
    const Eigen::Vector2d& a = outline_[i];
    const Eigen::Vector2d way = outline_[(i + 1) % outline_.size()] - a;
    // Image y points down, so that a surface seen from its front runs clockwise in these coordinates.
    const Eigen::Vector2d outward(-way.y(), way.x());
    const Eigen::Vector2d nearest(outward.x() > 0 ? low.x() : high.x(), outward.y() > 0 ? low.y() : high.y());
    if (outward.dot(nearest - a) > 0) return false;
  }
  return true;
}

float VisibleSurface::irradiance(const Eigen::Vector2d& at) const {
  return std::max(0.05F, irradiance_.x() + irradiance_.y() * static_cast<float>(at.x()) +
                             irradiance_.z() * static_cast<float>(at.y()));
}

float VisibleSurface::sheen(const Eigen::Vector2d& at) const {
  if (gloss_ <= 0) return 0;
  constexpr double kExponent = 60;  // semi-gloss: the highlight is about 15 deg wide
  const Eigen::Vector3d sight = (camera_in_surface_ - Eigen::Vector3d(at.x(), at.y(), 0)).normalized();
  const double cosine = (sight + lamp_in_surface_).normalized().z();
  return cosine > 0 ? gloss_ * static_cast<float>(std::pow(cosine, kExponent)) : 0.0F;
}

float VisibleSurface::grain(const Eigen::Vector2d& at) const {
  if (grain_ <= 0 || !at.allFinite()) return 1;
  const auto& texture = grain_texture();
  // The texture repeats; a grazing ray meets the plane kilometres away, where no int holds the index.
  const Eigen::Array2d texels = at.array() * texels_per_mm_ + 1e6;
  const Eigen::Array2d p = texels - kTexels * (texels / kTexels).floor();
  const int x = static_cast<int>(p.x());
  const int y = static_cast<int>(p.y());
  const auto u = static_cast<float>(p.x() - x);
  const auto v = static_cast<float>(p.y() - y);
  const auto texel = [&](int i, int j) {
    return texture[static_cast<std::size_t>((j & (kTexels - 1)) * kTexels + (i & (kTexels - 1)))];
  };
  const float top = (1 - u) * texel(x, y) + u * texel(x + 1, y);
  const float bottom = (1 - u) * texel(x, y + 1) + u * texel(x + 1, y + 1);
  return std::max(0.0F, 1 + grain_ * ((1 - v) * top + v * bottom));
}

}  // namespace hexcal
