#include "photogrammetry/camera/camera_model.h"

#include <Eigen/LU>
#include <array>
#include <cmath>

namespace hexcal {
namespace {

constexpr int kRadialOrder = 6;
using LensRow = Eigen::Matrix<double, 2, CameraModel::kMaxParameters - CameraModel::kNumPinhole>;

struct Decentring {
  double p1, p2;
};

// Adds decentring distortion and its derivatives.
void add_decentring(const Eigen::Vector2d& n, const Decentring& d, Eigen::Vector2d& out,
                    Eigen::Matrix2d* by_point) {
  const double x = n.x();
  const double y = n.y();
  const double r2 = x * x + y * y;
  out.x() += 2 * d.p1 * x * y + d.p2 * (r2 + 2 * x * x);
  out.y() += d.p1 * (r2 + 2 * y * y) + 2 * d.p2 * x * y;
  if (by_point != nullptr) {
    (*by_point)(0, 0) += 2 * d.p1 * y + 6 * d.p2 * x;
    (*by_point)(0, 1) += 2 * d.p1 * x + 2 * d.p2 * y;
    (*by_point)(1, 0) += 2 * d.p1 * x + 2 * d.p2 * y;
    (*by_point)(1, 1) += 6 * d.p1 * y + 2 * d.p2 * x;
  }
}

void decentring_columns(const Eigen::Vector2d& n, LensRow& by_lens, int p1, int p2) {
  const double r2 = n.squaredNorm();
  by_lens.col(p1) = Eigen::Vector2d(2 * n.x() * n.y(), r2 + 2 * n.y() * n.y());
  by_lens.col(p2) = Eigen::Vector2d(r2 + 2 * n.x() * n.x(), 2 * n.x() * n.y());
}

// n g, where g depends on r only; slope = (dg/dr) / r.
void radial_part(const Eigen::Vector2d& n, double g, double slope, Eigen::Vector2d& out,
                 Eigen::Matrix2d* by_point) {
  out = g * n;
  if (by_point != nullptr) {
    *by_point = g * Eigen::Matrix2d::Identity() + slope * n * n.transpose();
  }
}

Eigen::Vector2d distort_brown(const double* k, const Eigen::Vector2d& n, Eigen::Matrix2d* by_point,
                              LensRow* by_lens) {
  const double r2 = n.squaredNorm();
  const double r4 = r2 * r2;
  Eigen::Vector2d out;
  radial_part(n, 1 + k[0] * r2 + k[1] * r4 + k[4] * r4 * r2, 2 * (k[0] + 2 * k[1] * r2 + 3 * k[4] * r4), out,
              by_point);
  add_decentring(n, {k[2], k[3]}, out, by_point);
  if (by_lens != nullptr) {
    by_lens->col(0) = r2 * n;
    by_lens->col(1) = r4 * n;
    by_lens->col(4) = r4 * r2 * n;
    decentring_columns(n, *by_lens, 2, 3);
  }
  return out;
}

Eigen::Vector2d distort_rational(const double* k, const Eigen::Vector2d& n, Eigen::Matrix2d* by_point,
                                 LensRow* by_lens) {
  const double r2 = n.squaredNorm();
  const double r4 = r2 * r2;
  const double r6 = r4 * r2;
  const double over = 1 + k[0] * r2 + k[1] * r4 + k[4] * r6;
  const double under = 1 + k[5] * r2 + k[6] * r4 + k[7] * r6;
  const double g = over / under;
  const double over_slope = 2 * (k[0] + 2 * k[1] * r2 + 3 * k[4] * r4);
  const double under_slope = 2 * (k[5] + 2 * k[6] * r2 + 3 * k[7] * r4);
  Eigen::Vector2d out;
  radial_part(n, g, (over_slope - g * under_slope) / under, out, by_point);
  add_decentring(n, {k[2], k[3]}, out, by_point);
  const Eigen::Vector2d s12(k[8], k[10]);
  const Eigen::Vector2d s34(k[9], k[11]);
  out += s12 * r2 + s34 * r4;
  if (by_point != nullptr) *by_point += (2 * s12 + 4 * r2 * s34) * n.transpose();
  if (by_lens != nullptr) {
    const Eigen::Vector2d a = n / under;
    by_lens->col(0) = r2 * a;
    by_lens->col(1) = r4 * a;
    by_lens->col(4) = r6 * a;
    by_lens->col(5) = -g * r2 * a;
    by_lens->col(6) = -g * r4 * a;
    by_lens->col(7) = -g * r6 * a;
    decentring_columns(n, *by_lens, 2, 3);
    by_lens->col(8) = Eigen::Vector2d(r2, 0);
    by_lens->col(9) = Eigen::Vector2d(r4, 0);
    by_lens->col(10) = Eigen::Vector2d(0, r2);
    by_lens->col(11) = Eigen::Vector2d(0, r4);
  }
  return out;
}

Eigen::Vector2d distort_radial(const double* a, const Eigen::Vector2d& n, Eigen::Matrix2d* by_point,
                               LensRow* by_lens) {
  const double r = n.norm();
  double g = 0;
  double dg = 0;
  for (int i = kRadialOrder; i >= 1; --i) {
    dg = dg * r + g;
    g = g * r + a[i - 1];
  }
  // g holds sum a_i r^(i-1); its product with r is the factor minus one.
  dg = g + r * dg;
  Eigen::Vector2d out;
  radial_part(n, 1 + g * r, r > 0 ? dg / r : 0.0, out, by_point);
  add_decentring(n, {a[kRadialOrder], a[kRadialOrder + 1]}, out, by_point);
  if (by_lens != nullptr) {
    double power = r;
    for (int i = 0; i < kRadialOrder; ++i, power *= r) by_lens->col(i) = power * n;
    decentring_columns(n, *by_lens, kRadialOrder, kRadialOrder + 1);
  }
  return out;
}

Eigen::Vector2d distort_with_jacobian(const CameraModel& camera, const Eigen::Vector2d& n,
                                      Eigen::Matrix2d* by_point, LensRow* by_lens) {
  const double* k = camera.parameters.data() + CameraModel::kNumPinhole;
  switch (camera.lens) {
    case LensModel::brown:
      return distort_brown(k, n, by_point, by_lens);
    case LensModel::rational:
      return distort_rational(k, n, by_point, by_lens);
    case LensModel::radial:
      return distort_radial(k, n, by_point, by_lens);
  }
  return n;
}

constexpr std::array kLenses{LensModel::brown, LensModel::rational, LensModel::radial};

}  // namespace

std::string_view lens_model_name(LensModel lens) {
  switch (lens) {
    case LensModel::brown:
      return "brown";
    case LensModel::rational:
      return "rational";
    case LensModel::radial:
      return "radial";
  }
  return "";
}

std::optional<LensModel> lens_model_from_name(std::string_view name) {
  for (const LensModel lens : kLenses) {
    if (lens_model_name(lens) == name) return lens;
  }
  return std::nullopt;
}

const std::vector<std::string>& camera_parameter_names(LensModel lens) {
  static const std::vector<std::string> brown{"f_px", "affinity", "cx_px", "cy_px", "k1",
                                              "k2",   "p1",       "p2",    "k3"};
  static const std::vector<std::string> rational{"f_px", "affinity", "cx_px", "cy_px", "k1", "k2",
                                                 "p1",   "p2",       "k3",    "k4",    "k5", "k6",
                                                 "s1",   "s2",       "s3",    "s4"};
  static const std::vector<std::string> radial{"f_px", "affinity", "cx_px", "cy_px", "a1", "a2",
                                               "a3",   "a4",       "a5",    "a6",    "p1", "p2"};
  switch (lens) {
    case LensModel::brown:
      return brown;
    case LensModel::rational:
      return rational;
    case LensModel::radial:
      return radial;
  }
  return brown;
}

CameraModel::CameraModel(int width, int height, double f_px, LensModel lens_model)
    : width_px(width), height_px(height), lens(lens_model) {
  parameters.setZero(static_cast<Eigen::Index>(camera_parameter_names(lens).size()));
  parameters[0] = f_px;
  parameters[2] = 0.5 * (width - 1);
  parameters[3] = 0.5 * (height - 1);
}

Eigen::Vector2d CameraModel::distort(const Eigen::Vector2d& normalised) const {
  return distort_with_jacobian(*this, normalised, nullptr, nullptr);
}

Eigen::Vector2d CameraModel::image_from_normalised(const Eigen::Vector2d& normalised) const {
  const Eigen::Vector2d d = distort(normalised);
  return {fx_px() * d.x() + cx_px(), fy_px() * d.y() + cy_px()};
}

Eigen::Vector2d CameraModel::image_from_normalised(const Eigen::Vector2d& normalised,
                                                   Eigen::Matrix2d* by_point,
                                                   ByParameters* by_parameters) const {
  LensRow by_lens;
  const Eigen::Vector2d d =
      distort_with_jacobian(*this, normalised, by_point, by_parameters != nullptr ? &by_lens : nullptr);
  const Eigen::Vector2d focal(fx_px(), fy_px());
  if (by_point != nullptr) *by_point = focal.asDiagonal() * *by_point;
  if (by_parameters != nullptr) {
    by_parameters->resize(2, parameters.size());
    by_parameters->col(0) = Eigen::Vector2d((1.0 + parameters[1]) * d.x(), d.y());
    by_parameters->col(1) = Eigen::Vector2d(parameters[0] * d.x(), 0);
    by_parameters->col(2) = Eigen::Vector2d::UnitX();
    by_parameters->col(3) = Eigen::Vector2d::UnitY();
    const Eigen::Index count = parameters.size() - kNumPinhole;
    by_parameters->rightCols(count) = focal.asDiagonal() * by_lens.leftCols(count);
  }
  return {focal.x() * d.x() + cx_px(), focal.y() * d.y() + cy_px()};
}

std::optional<Eigen::Vector2d> CameraModel::normalised_from_image(const Eigen::Vector2d& px) const {
  const Eigen::Vector2d target((px.x() - cx_px()) / fx_px(), (px.y() - cy_px()) / fy_px());
  Eigen::Vector2d n = target;
  for (int iteration = 0; iteration < 50; ++iteration) {
    Eigen::Matrix2d j;
    const Eigen::Vector2d residual = distort_with_jacobian(*this, n, &j, nullptr) - target;
    const double det = j.determinant();
    if (!(det > 1e-6) || !residual.allFinite()) return std::nullopt;
    const Eigen::Vector2d step = j.inverse() * residual;
    n -= step;
    if (step.squaredNorm() < 1e-28) return n;
  }
  const bool converged = (distort(n) - target).norm() < 1e-11;
  return converged ? std::optional<Eigen::Vector2d>(n) : std::nullopt;
}

std::optional<Eigen::Vector2d> CameraModel::project(const Eigen::Vector3d& point_in_camera) const {
  if (!(point_in_camera.z() > 0)) return std::nullopt;
  const Eigen::Vector2d normalised = point_in_camera.head<2>() / point_in_camera.z();
  if (normalised.norm() > valid_radius) return std::nullopt;
  return image_from_normalised(normalised);
}

}  // namespace hexcal
