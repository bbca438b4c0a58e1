#include "photogrammetry/markers/pixel_map.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace hexcal {
namespace {

constexpr int kTerms = 6;
using Terms = Eigen::Matrix<double, kTerms, 1>;
using Square = Eigen::Matrix<double, kTerms, kTerms>;

Terms powers(double x) {
  Terms p;
  p[0] = 1;
  for (int i = 1; i < kTerms; ++i) p[i] = p[i - 1] * x;
  return p;
}

Terms power_derivatives(double x) {
  const Terms p = powers(x);
  Terms d;
  d[0] = 0;
  for (int i = 1; i < kTerms; ++i) d[i] = i * p[i - 1];
  return d;
}

double chebyshev_node(int i) { return -std::cos(std::numbers::pi * (i + 0.5) / kTerms); }

// Powers' coefficients from values at the Chebyshev nodes.
const Square& coefficients_from_values() {
  static const Square inverse = [] {
    Square vandermonde;
    for (int i = 0; i < kTerms; ++i) vandermonde.row(i) = powers(chebyshev_node(i)).transpose();
    return Square(vandermonde.inverse());
  }();
  return inverse;
}

}  // namespace

PixelMap::PixelMap(int width_px, int height_px, const LensStandIn& lens)
    : centre_(0.5 * (width_px - 1), 0.5 * (height_px - 1)),
      per_half_diagonal_(2 / std::hypot(width_px, height_px)),
      lens_(lens) {}

std::optional<Eigen::Vector2d> PixelMap::ideal_from_pixel(const Eigen::Vector2d& px) const {
  if (camera_ != nullptr) {
    const auto normalised = camera_->normalised_from_image(px);
    if (!normalised) return std::nullopt;
    return Eigen::Vector2d(*normalised * camera_->fy_px());
  }
  const Eigen::Vector2d offset = px - centre_;
  const double r2 = (offset * per_half_diagonal_).squaredNorm();
  return Eigen::Vector2d(offset * (1 + r2 * (lens_.k1 + r2 * lens_.k2)));
}

Eigen::Vector2d PixelMap::pixel_from_ideal(const Eigen::Vector2d& ideal, Eigen::Matrix2d* by_ideal) const {
  if (camera_ != nullptr) {
    const Eigen::Vector2d px = camera_->image_from_normalised(ideal / camera_->fy_px(), by_ideal, nullptr);
    if (by_ideal != nullptr) *by_ideal /= camera_->fy_px();
    return px;
  }
  Eigen::Vector2d offset = ideal;
  Eigen::Matrix2d j = Eigen::Matrix2d::Identity();
  for (int iteration = 0; iteration < 20; ++iteration) {
    const Eigen::Vector2d scaled = offset * per_half_diagonal_;
    const double r2 = scaled.squaredNorm();
    j = (1 + r2 * (lens_.k1 + r2 * lens_.k2)) * Eigen::Matrix2d::Identity() +
        2 * (lens_.k1 + 2 * r2 * lens_.k2) * scaled * scaled.transpose();
    const Eigen::Vector2d step = j.inverse() * (ideal - *ideal_from_pixel(centre_ + offset));
    offset += step;
    if (step.squaredNorm() < 1e-24) break;
  }
  if (by_ideal != nullptr) *by_ideal = j.inverse();
  return centre_ + offset;
}

Eigen::Matrix2d PixelMap::by_stand_in(const Eigen::Vector2d& px) const {
  const Eigen::Vector2d offset = px - centre_;
  const double r2 = (offset * per_half_diagonal_).squaredNorm();
  Eigen::Matrix2d by;
  by.col(0) = r2 * offset;
  by.col(1) = r2 * r2 * offset;
  return by;
}

std::optional<PixelMapPatch> PixelMapPatch::fit(const PixelMap& map, const cv::Rect& box) {
  PixelMapPatch patch;
  patch.middle_ = {box.x + 0.5 * (box.width - 1), box.y + 0.5 * (box.height - 1)};
  patch.half_ = {std::max(0.5 * box.width, 4.0), std::max(0.5 * box.height, 4.0)};
  std::array<Square, 2> values;
  for (int j = 0; j < kTerms; ++j) {
    for (int i = 0; i < kTerms; ++i) {
      const Eigen::Vector2d node(chebyshev_node(i), chebyshev_node(j));
      const auto ideal = map.ideal_from_pixel(patch.middle_ + patch.half_.cwiseProduct(node));
      if (!ideal) return std::nullopt;
      values[0](i, j) = ideal->x();
      values[1](i, j) = ideal->y();
    }
  }
  const Square& inverse = coefficients_from_values();
  for (std::size_t k = 0; k < 2; ++k) patch.coefficients_[k] = inverse * values[k] * inverse.transpose();
  return patch;
}

PixelMapPatch::Row PixelMapPatch::row(double y_px) const {
  const double y = (y_px - middle_.y()) / half_.y();
  const Terms values = powers(y);
  const Terms slopes = power_derivatives(y) / half_.y();
  Row row;
  row.middle_ = middle_.x();
  row.half_ = half_.x();
  for (int k = 0; k < 2; ++k) {
    row.coefficients_.row(k) = (coefficients_[static_cast<std::size_t>(k)] * values).transpose();
    row.coefficients_.row(2 + k) = (coefficients_[static_cast<std::size_t>(k)] * slopes).transpose();
  }
  return row;
}

PixelMapPatch::Point PixelMapPatch::Row::at(double x_px) const {
  const double x = (x_px - middle_) / half_;
  Eigen::Vector4d value = coefficients_.col(kTerms - 1);
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  for (int i = kTerms - 2; i >= 0; --i) {
    slope = slope * x + value.head<2>();
    value = value * x + coefficients_.col(i);
  }
  Point point;
  point.ideal = value.head<2>();
  point.by_px.col(0) = slope / half_;
  point.by_px.col(1) = value.tail<2>();
  return point;
}

}  // namespace hexcal
