#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "photogrammetry/markers/image_noise.h"
#include "photogrammetry/markers/normal_distribution.h"
#include "photogrammetry/markers/refine.h"
#include "photogrammetry/photograph/tone_response.h"

namespace hexcal {
namespace {

constexpr double kPixelVariance = 1.0 / 12;
constexpr double kReachPx = 4;
constexpr double kMinRadiusPx = 2;
constexpr double kMaxMovePx = 4;
constexpr double kMaxClippedShare = 0.02;  // of its pixels
constexpr double kNoiseMarginPx = 40;
constexpr std::size_t kMaxPixels = 1500;
constexpr int kMaxIterations = 20;
constexpr double kTolerancePx = 2e-4;

// Centre shift in the image's axes (px, taken to the plane by the Jacobian at the centre), relative growth of
// the radius, variance of the point spread, level of the surroundings, of the dot, illumination gradient.
constexpr int kCount = 8;
using Vector = Eigen::Matrix<double, kCount, 1>;
using Matrix = Eigen::Matrix<double, kCount, kCount>;

struct DotPixel {
  Eigen::Vector2d offset;  // from the disc's nominal centre, in the plane
  Eigen::Matrix2d by_px;   // its derivatives by the pixel
  Eigen::Vector2d light;   // offset in the image, for the illumination
  double value, weight;
};

struct DiscShare {
  double value = 0;
  Eigen::Vector2d by_centre = Eigen::Vector2d::Zero();  // by the way from the disc's centre
  double by_radius = 0, by_sigma = 0;
};

// Share of an isotropic Gaussian (standard deviation `sigma` px) around a pixel that falls into a disc of the
// plane, the plane's map being affine over the Gaussian: chords of the disc along its steepest direction,
// summed over the other direction by a rule that is exact to rounding for smooth integrands (trapezoid).
DiscShare disc_share(const Eigen::Vector2d& from_centre, const Eigen::Matrix2d& by_px, double radius,
                     double sigma) {
  Eigen::Vector2d steepest = by_px.transpose() * from_centre;
  if (steepest.squaredNorm() < 1e-30) steepest = Eigen::Vector2d::UnitX();
  steepest.normalize();
  const Eigen::Vector2d n = by_px * steepest;
  const Eigen::Vector2d t = by_px * Eigen::Vector2d(-steepest.y(), steepest.x());
  constexpr double kStep = 0.7;
  constexpr int kHalfCount = 6;
  static const std::array<double, 2 * kHalfCount + 1> kWeights = [] {
    std::array<double, 2 * kHalfCount + 1> weights{};
    double total = 0;
    for (int i = -kHalfCount; i <= kHalfCount; ++i) total += standard_normal(i * kStep).density;
    for (int i = -kHalfCount; i <= kHalfCount; ++i) {
      weights[static_cast<std::size_t>(i + kHalfCount)] = standard_normal(i * kStep).density / total;
    }
    return weights;
  }();
  const double a = n.squaredNorm();
  DiscShare share;
  for (int i = -kHalfCount; i <= kHalfCount; ++i) {
    const double at = i * kStep;
    const double weight = kWeights[static_cast<std::size_t>(i + kHalfCount)];
    const Eigen::Vector2d base = from_centre + t * (at * sigma);
    const double b = n.dot(base);
    const double discriminant = b * b - a * (base.squaredNorm() - radius * radius);
    if (discriminant <= 0) continue;
    const double root = std::sqrt(discriminant);
    for (const double end : {1.0, -1.0}) {  // of the chord
      const double u = (-b + end * root) / (a * sigma);
      const NormalValue normal = standard_normal(u);
      const Eigen::Vector2d u_by_base = (end * (b * n - a * base) / root - n) / (a * sigma);
      const double density = end * weight * normal.density;
      share.value += end * weight * normal.cdf;
      share.by_centre += density * u_by_base;
      share.by_radius += density * end * radius / (root * sigma);
      share.by_sigma += density * (u_by_base.dot(t) * at - u / sigma);
    }
  }
  return share;
}

struct DotView {
  Eigen::Matrix3d image_from_plane, plane_from_image;
  Eigen::Vector2d centre;  // nominal, in the plane
  double radius = 0;
  Eigen::Vector2d centre_px;
  Eigen::Matrix2d by_px;  // plane by pixel, at the centre
  double radius_px = 0;   // smallest of its image
};

Eigen::Matrix2d plane_by_pixel(const Eigen::Matrix3d& g, const Eigen::Vector2d& px) {
  const Eigen::Vector3d h = g * px.homogeneous();
  return (g.topLeftCorner<2, 2>() - h.hnormalized() * g.block<1, 2>(2, 0)) / h.z();
}

DotView view_of(const Eigen::Matrix3d& image_from_plane, const Eigen::Vector2d& centre, double radius) {
  DotView view{image_from_plane, image_from_plane.inverse(), centre, radius, {}, {}, 0};
  view.centre_px = (image_from_plane * centre.homogeneous()).hnormalized();
  view.by_px = plane_by_pixel(view.plane_from_image, view.centre_px);
  // The smallest half axis: radius over the largest singular value.
  const Eigen::Matrix2d square = view.by_px.transpose() * view.by_px;
  const double half_trace = 0.5 * square.trace();
  const double largest =
      half_trace + std::sqrt(std::max(half_trace * half_trace - square.determinant(), 0.0));
  view.radius_px = radius / std::sqrt(largest);
  return view;
}

double raw_value(const cv::Mat& grey, int x, int y) {
  return grey.depth() == CV_16U ? grey.at<std::uint16_t>(y, x) : grey.at<std::uint8_t>(y, x);
}

struct DotPixels {
  std::vector<DotPixel> pixels;
  int clipped = 0;
};

// Pixels within reach of the disc's rim.
DotPixels pixels_around_rim(const cv::Mat& grey, const DotView& view, const NoiseModel& noise) {
  DotPixels result;
  const double scale = 1 / full_scale(grey);
  const Eigen::Matrix2d px_by_plane = view.by_px.inverse();
  const double extent = 1.2 * view.radius * px_by_plane.norm() + kReachPx;
  for (int y = static_cast<int>(view.centre_px.y() - extent); y <= view.centre_px.y() + extent; ++y) {
    for (int x = static_cast<int>(view.centre_px.x() - extent); x <= view.centre_px.x() + extent; ++x) {
      if (x < 0 || y < 0 || x >= grey.cols || y >= grey.rows) continue;
      const Eigen::Vector2d px(x, y);
      DotPixel pixel;
      pixel.offset = (view.plane_from_image * px.homogeneous()).hnormalized() - view.centre;
      pixel.by_px = plane_by_pixel(view.plane_from_image, px);
      const double distance = pixel.offset.norm();
      const double per_px =
          distance > 1e-12 ? (pixel.by_px.transpose() * pixel.offset / distance).norm() : 1e300;
      if (std::abs(distance - view.radius) > kReachPx * per_px) continue;
      const double raw = raw_value(grey, x, y) * scale;
      if (raw <= 0 || raw >= 1) {
        ++result.clipped;
        continue;
      }
      pixel.light = (px - view.centre_px) / std::max(view.radius_px, 1.0);
      pixel.value = raw;
      pixel.weight = 1 / std::sqrt(noise.variance(raw));
      result.pixels.push_back(pixel);
    }
  }
  // Every k-th, k odd: a large dot's rim is told well enough.
  const std::size_t step = result.pixels.size() / kMaxPixels | 1U;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < result.pixels.size(); i += step) result.pixels[kept++] = result.pixels[i];
  result.pixels.resize(kept);
  return result;
}

DiscShare share_at(const DotView& view, const DotPixel& pixel, const Vector& p) {
  return disc_share(pixel.offset - view.by_px * p.head<2>(), pixel.by_px, view.radius * (1 + p[2]),
                    std::sqrt(p[3] + kPixelVariance));
}

// The encoded value of a pixel and its derivatives by the parameters.
double modelled(const DotView& view, const ToneResponse& tone, const DotPixel& pixel, const Vector& p,
                Vector& row) {
  const DiscShare share = share_at(view, pixel, p);
  const double shade = 1 + p.tail<2>().dot(pixel.light);
  const double unshaded = p[4] + (p[5] - p[4]) * share.value;
  const ToneResponse::Encoded encoded = tone.encode(unshaded * shade);
  const double by_share = encoded.by_light * shade * (p[5] - p[4]);
  row.head<2>() = -by_share * (view.by_px.transpose() * share.by_centre);
  row[2] = by_share * share.by_radius * view.radius;
  row[3] = by_share * share.by_sigma / (2 * std::sqrt(p[3] + kPixelVariance));
  row[4] = encoded.by_light * shade * (1 - share.value);
  row[5] = encoded.by_light * shade * share.value;
  row.tail<2>() = encoded.by_light * unshaded * pixel.light;
  return encoded.value;
}

struct Normals {
  Matrix n = Matrix::Zero();
  Vector rhs = Vector::Zero();
  double cost = 0;
};

Normals normals(const DotView& view, const ToneResponse& tone, const std::vector<DotPixel>& pixels,
                const Vector& p) {
  Normals result;
  Vector row;
  for (const DotPixel& pixel : pixels) {
    const double residual = (pixel.value - modelled(view, tone, pixel, p, row)) * pixel.weight;
    row *= pixel.weight;
    result.n += row * row.transpose();
    result.rhs += row * residual;
    result.cost += residual * residual;
  }
  return result;
}

// Levels by linear least squares in linear light.
bool set_levels(const DotView& view, const ToneResponse& tone, const std::vector<DotPixel>& pixels,
                Vector& p) {
  Eigen::Matrix2d n = Eigen::Matrix2d::Zero();
  Eigen::Vector2d rhs = Eigen::Vector2d::Zero();
  for (const DotPixel& pixel : pixels) {
    const double share = share_at(view, pixel, p).value;
    const Eigen::Vector2d row(1 - share, share);
    n += row * row.transpose();
    rhs += row * tone.decode(pixel.value);
  }
  if (pixels.size() < 2 * kCount || n.determinant() < 1e-6) return false;
  p.segment<2>(4) = n.inverse() * rhs;
  return true;
}

// Levenberg-Marquardt; the normal equations at the end, none if it did not converge.
std::optional<Normals> solve(const DotView& view, const ToneResponse& tone,
                             const std::vector<DotPixel>& pixels, Vector& p) {
  double damping = 1e-4;
  Normals at = normals(view, tone, pixels, p);
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    Matrix n = at.n;
    n.diagonal() *= 1 + damping;
    const Vector step = n.ldlt().solve(at.rhs);
    if (!step.allFinite()) return std::nullopt;
    Vector candidate = p + step;
    candidate[2] = std::clamp(candidate[2], -0.4, 0.4);
    candidate[3] = std::clamp(candidate[3], 0.02, 16.0);
    const Normals next = normals(view, tone, pixels, candidate);
    if (next.cost <= at.cost) {
      p = candidate;
      at = next;
      damping *= 0.1;
      if (step.head<2>().norm() < kTolerancePx) return at;
    } else {
      damping *= 20;
      if (damping > 1e6) return at;
    }
  }
  return at;
}

}  // namespace

PointObservation refine_dot(const cv::Mat& grey, ToneCurve tone, const Eigen::Matrix3d& image_from_plane,
                            const Eigen::Vector2d& centre_in_plane, double radius,
                            const RefineOptions& options) {
  options.validate();
  PointObservation point;
  DotView view = view_of(image_from_plane, centre_in_plane, radius);
  point.px = view.centre_px;
  if (!(view.radius_px >= kMinRadiusPx)) {
    point.status = MarkerStatus::too_small;
    return point;
  }
  const double reach = radius * view.by_px.inverse().norm() + 1;
  if (point.px.minCoeff() < reach || point.px.x() > grey.cols - 1 - reach ||
      point.px.y() > grey.rows - 1 - reach) {
    point.status = MarkerStatus::cut_by_frame;
    return point;
  }
  const double around = reach + kNoiseMarginPx;
  const NoiseModel noise =
      estimate_noise(grey, {static_cast<int>(point.px.x() - around), static_cast<int>(point.px.y() - around),
                            static_cast<int>(2 * around), static_cast<int>(2 * around)});
  const ToneResponse response(tone);
  const DotPixels selected = pixels_around_rim(grey, view, noise);
  Vector p = Vector::Zero();
  p[3] = 0.5;
  if (!set_levels(view, response, selected.pixels, p)) return point;
  const auto at = solve(view, response, selected.pixels, p);
  if (!at) return point;

  const Eigen::Vector2d centre = view.centre + view.by_px * p.head<2>();
  point.px = (view.image_from_plane * centre.homogeneous()).hnormalized();
  point.chi2_per_dof = at->cost / static_cast<double>(selected.pixels.size() - kCount);
  const Matrix covariance = at->n.ldlt().solve(Matrix::Identity());
  // The windows that tell the noise hold edges too, so that the residuals know better.
  point.covariance_px2 = covariance.topLeftCorner<2, 2>() * point.chi2_per_dof;
  point.blur_px = std::sqrt(p[3]);
  point.contrast = std::abs(p[5] - p[4]);
  const double clipped = selected.clipped;
  if (!point.px.allFinite() || p.head<2>().norm() > kMaxMovePx) {
    point.status = MarkerStatus::not_refined;
  } else if (clipped > kMaxClippedShare * (static_cast<double>(selected.pixels.size()) + clipped)) {
    point.status = MarkerStatus::saturated;
  } else if (point.contrast < options.min_contrast) {
    point.status = MarkerStatus::low_contrast;
  } else if (point.chi2_per_dof > 4 * options.max_chi2_per_dof) {
    point.status = MarkerStatus::misfit;
  } else {
    point.status = MarkerStatus::ok;
  }
  return point;
}

}  // namespace hexcal
