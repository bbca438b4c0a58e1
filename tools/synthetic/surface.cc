#include "tools/synthetic/surface.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hexcal {
namespace {

constexpr int kBins = 48;

Eigen::Vector2d lower_right(const Decal& decal) {
  return {decal.top_left_mm.x() + decal.columns * decal.cell_mm.x(),
          decal.top_left_mm.y() - decal.rows * decal.cell_mm.y()};
}

int cell_index(double distance_mm, double cell_mm, int count) {
  return std::clamp(static_cast<int>(std::floor(distance_mm / cell_mm)), 0, count - 1);
}

// Albedo of a decal at a point, negative where it does not cover.
float decal_albedo(const Decal& decal, const Eigen::Vector2d& p) {
  const double x = p.x() - decal.top_left_mm.x();
  const double y = decal.top_left_mm.y() - p.y();
  if (x < 0 || y < 0 || x >= decal.columns * decal.cell_mm.x() || y >= decal.rows * decal.cell_mm.y())
    return -1;
  if (decal.round) {
    const double dx = 2 * x / decal.cell_mm.x() - 1;
    const double dy = 2 * y / decal.cell_mm.y() - 1;
    return dx * dx + dy * dy < 1 ? decal.albedo[0] : -1;
  }
  const int column = cell_index(x, decal.cell_mm.x(), decal.columns);
  const int row = cell_index(y, decal.cell_mm.y(), decal.rows);
  return decal.albedo[static_cast<std::size_t>(row * decal.columns + column)];
}

enum class DecalCover { none, uniform, mixed };

DecalCover decal_cover(const Decal& decal, const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                       float& albedo) {
  const Eigen::Vector2d end = lower_right(decal);
  if (high.x() <= decal.top_left_mm.x() || low.x() >= end.x() || high.y() <= end.y() ||
      low.y() >= decal.top_left_mm.y()) {
    return DecalCover::none;
  }
  if (decal.round) {
    const Eigen::Vector2d centre = 0.5 * (decal.top_left_mm + end);
    const Eigen::Vector2d radius = 0.5 * decal.cell_mm;
    const Eigen::Vector2d near = low.cwiseMax(centre.cwiseMin(high));
    if ((near - centre).cwiseQuotient(radius).squaredNorm() >= 1) return DecalCover::none;
    const Eigen::Vector2d far = (low - centre).cwiseAbs().cwiseMax((high - centre).cwiseAbs());
    if (far.cwiseQuotient(radius).squaredNorm() >= 1) return DecalCover::mixed;
    albedo = decal.albedo[0];
    return DecalCover::uniform;
  }
  if (low.x() < decal.top_left_mm.x() || high.x() > end.x() || low.y() < end.y() ||
      high.y() > decal.top_left_mm.y()) {
    return DecalCover::mixed;
  }
  const int c0 = cell_index(low.x() - decal.top_left_mm.x(), decal.cell_mm.x(), decal.columns);
  const int c1 = cell_index(high.x() - decal.top_left_mm.x(), decal.cell_mm.x(), decal.columns);
  const int r0 = cell_index(decal.top_left_mm.y() - high.y(), decal.cell_mm.y(), decal.rows);
  const int r1 = cell_index(decal.top_left_mm.y() - low.y(), decal.cell_mm.y(), decal.rows);
  const auto at = [&](int row, int column) {
    return decal.albedo[static_cast<std::size_t>(row * decal.columns + column)];
  };
  albedo = at(r0, c0);
  for (int row = r0; row <= r1; ++row) {
    for (int column = c0; column <= c1; ++column) {
      if (at(row, column) != albedo) return DecalCover::mixed;
    }
  }
  return albedo < 0 ? DecalCover::none : DecalCover::uniform;
}

}  // namespace

Eigen::Vector3d Surface::printed_point(const Eigen::Vector2d& drawn_mm) const {
  const Eigen::Vector2d p = drawn_mm.cwiseProduct(print_scale);
  return {p.x(), p.y(), warp ? warp->z(p) : 0.0};
}

std::vector<Eigen::Vector2d> rectangle_outline(double half_width_mm, double half_height_mm) {
  return {{-half_width_mm, -half_height_mm},
          {half_width_mm, -half_height_mm},
          {half_width_mm, half_height_mm},
          {-half_width_mm, half_height_mm}};
}

SurfacePaint::SurfacePaint(const Surface& surface)
    : base_albedo_(surface.albedo),
      darkest_(surface.albedo),
      ink_spread_mm_(surface.ink_spread_mm),
      decals_(surface.decals) {
  const std::size_t count = surface.outline_mm.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d& a = surface.outline_mm[i];
    const Eigen::Vector2d way = surface.outline_mm[(i + 1) % count] - a;
    const Eigen::Vector2d inward(-way.y(), way.x());
    edges_.emplace_back(inward.x(), inward.y(), -inward.dot(a));
  }
  // The bins cover what is printed; points beyond it fall into the outermost ones.
  for (std::size_t i = 0; i < decals_.size(); ++i) {
    const Eigen::Vector2d end = lower_right(decals_[i]);
    const Eigen::Vector2d low(decals_[i].top_left_mm.x(), end.y());
    const Eigen::Vector2d high(end.x(), decals_[i].top_left_mm.y());
    low_ = i == 0 ? low : Eigen::Vector2d(low_.cwiseMin(low));
    high_ = i == 0 ? high : Eigen::Vector2d(high_.cwiseMax(high));
  }
  for (const Decal& decal : decals_) {
    for (const float albedo : decal.albedo) {
      if (albedo >= 0) darkest_ = std::min(darkest_, albedo);
    }
  }
  if (decals_.empty()) return;
  bins_per_mm_ = (kBins * Eigen::Vector2d::Ones()).cwiseQuotient(high_ - low_);
  bins_.resize(kBins * kBins);
  for (std::size_t i = 0; i < decals_.size(); ++i) {
    const Eigen::Vector2d end = lower_right(decals_[i]);
    for (int y = bin_index(end.y(), 1); y <= bin_index(decals_[i].top_left_mm.y(), 1); ++y) {
      for (int x = bin_index(decals_[i].top_left_mm.x(), 0); x <= bin_index(end.x(), 0); ++x) {
        bins_[static_cast<std::size_t>(y * kBins + x)].decals.push_back(static_cast<int>(i));
      }
    }
  }
}

int SurfacePaint::bin_index(double coordinate, int axis) const {
  return std::clamp(static_cast<int>((coordinate - low_[axis]) * bins_per_mm_[axis]), 0, kBins - 1);
}

bool SurfacePaint::inside(const Eigen::Vector2d& p) const {
  return std::all_of(edges_.begin(), edges_.end(), [&](const Eigen::Vector3d& edge) {
    return edge.x() * p.x() + edge.y() * p.y() + edge.z() >= 0;
  });
}

float SurfacePaint::albedo(const Eigen::Vector2d& p) const {
  float albedo = drawn_albedo(p);
  if (ink_spread_mm_ <= 0 || albedo <= darkest_) return albedo;
  if (drawn_footprint(p.array() - ink_spread_mm_, p.array() + ink_spread_mm_).cover == Cover::uniform)
    return albedo;
  // Ink grows by a disc: exact along straight edges, an octagon at corners.
  const double s = ink_spread_mm_;
  const double d = s / std::numbers::sqrt2;
  for (const Eigen::Vector2d& way :
       {Eigen::Vector2d(s, 0), {-s, 0}, {0, s}, {0, -s}, {d, d}, {d, -d}, {-d, d}, {-d, -d}}) {
    albedo = std::min(albedo, drawn_albedo(p + way));
  }
  return albedo;
}

float SurfacePaint::drawn_albedo(const Eigen::Vector2d& p) const {
  if (decals_.empty()) return base_albedo_;
  const auto& near =
      bins_[static_cast<std::size_t>(bin_index(p.y(), 1) * kBins + bin_index(p.x(), 0))].decals;
  for (auto i = near.rbegin(); i != near.rend(); ++i) {
    const float albedo = decal_albedo(decals_[static_cast<std::size_t>(*i)], p);
    if (albedo >= 0) return albedo;
  }
  return base_albedo_;
}

Footprint SurfacePaint::footprint(const Eigen::Vector2d& low, const Eigen::Vector2d& high) const {
  bool inside = true;
  for (const Eigen::Vector3d& edge : edges_) {
    const double x_far = edge.x() * (edge.x() > 0 ? high.x() : low.x());
    const double y_far = edge.y() * (edge.y() > 0 ? high.y() : low.y());
    if (x_far + y_far + edge.z() < 0) return {Cover::outside, 0};
    const double x_near = edge.x() * (edge.x() > 0 ? low.x() : high.x());
    const double y_near = edge.y() * (edge.y() > 0 ? low.y() : high.y());
    inside = inside && x_near + y_near + edge.z() >= 0;
  }
  if (!inside) return {Cover::partly, 0};
  // Ink may reach into the rectangle from so far around it.
  return drawn_footprint(low.array() - ink_spread_mm_, high.array() + ink_spread_mm_);
}

Footprint SurfacePaint::drawn_footprint(const Eigen::Vector2d& low, const Eigen::Vector2d& high) const {
  if (decals_.empty()) return {Cover::uniform, base_albedo_};
  const int x0 = bin_index(low.x(), 0);
  const int x1 = bin_index(high.x(), 0);
  const int y0 = bin_index(low.y(), 1);
  const int y1 = bin_index(high.y(), 1);
  if (x1 - x0 > 4 || y1 - y0 > 4) return {Cover::mixed, 0};
  // The topmost decal that touches the rectangle decides; over several bins it is the highest index.
  int top = -1;
  Footprint result{Cover::uniform, base_albedo_};
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const auto& near = bins_[static_cast<std::size_t>(y * kBins + x)].decals;
      for (auto i = near.rbegin(); i != near.rend() && *i > top; ++i) {
        float albedo = 0;
        const DecalCover cover = decal_cover(decals_[static_cast<std::size_t>(*i)], low, high, albedo);
        if (cover == DecalCover::none) continue;
        if (cover == DecalCover::mixed) return {Cover::mixed, 0};
        top = *i;
        result = {Cover::uniform, albedo};
        break;
      }
    }
  }
  return result;
}

}  // namespace hexcal
