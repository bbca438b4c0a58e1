#include "tools/bench/marker_bound.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "photogrammetry/markers/blurred_pattern.h"

namespace hexcal {
namespace {

using Corners = std::array<Eigen::Vector2d, 4>;

constexpr int kParameters = 11;  // corners, black, white, variance of the blur
constexpr double kReachPx = 6;
// Red, green and blue in the luminance of a JPEG; their noise is independent.
constexpr std::array<double, 3> kLuma{0.299, 0.587, 0.114};

std::optional<Eigen::Matrix3d> cells_from_px(const Corners& corners, const MarkerPattern& pattern) {
  const double low = 0.5 * (pattern.cells - pattern.square_cells);
  const double high = low + pattern.square_cells;
  const double to[4][2] = {{low, low}, {high, low}, {high, high}, {low, high}};
  Eigen::Matrix<double, 8, 8> a = Eigen::Matrix<double, 8, 8>::Zero();
  Eigen::Matrix<double, 8, 1> b;
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector2d& p = corners[static_cast<std::size_t>(i)];
    for (int k = 0; k < 2; ++k) {
      a.block<1, 3>(2 * i + k, 3 * k) << p.x(), p.y(), 1;
      a.block<1, 2>(2 * i + k, 6) = -to[i][k] * p.transpose();
      b[2 * i + k] = to[i][k];
    }
  }
  const Eigen::Matrix<double, 8, 1> h = a.partialPivLu().solve(b);
  if (!h.allFinite()) return std::nullopt;
  Eigen::Matrix3d homography;
  homography << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1;
  return homography;
}

double tone_slope(double light, ToneCurveKind tone) {
  constexpr double kStep = 1e-4;
  const double low = std::max(light - kStep, 0.0);
  return (toned(tone, light + kStep) - toned(tone, low)) / (light + kStep - low);
}

// Variance of a pixel's luminance after encoding, full scale 1.
double encoded_variance(double light, double slope, const SensorOptions& sensor) {
  const double electrons = sensor.full_well_electrons > 0 ? light / sensor.full_well_electrons : 0;
  const double in_light = electrons + sensor.read_noise * sensor.read_noise;
  constexpr double kRounding = 1.0 / 12 / (255.0 * 255.0);
  double channels = 0;
  for (const double share : kLuma) channels += share * share;
  return channels * (slope * slope * in_light + kRounding) + kRounding;
}

}  // namespace

std::optional<Eigen::Matrix<double, 8, 8>> corner_bound(const MarkerPattern& pattern,
                                                        const MarkerImage& image,
                                                        const SensorOptions& sensor) {
  constexpr double kMovePx = 0.01;
  const auto homography = cells_from_px(image.corners_px, pattern);
  if (!homography) return std::nullopt;
  std::array<Eigen::Matrix3d, 16> moved;
  for (std::size_t k = 0; k < 16; ++k) {
    Corners corners = image.corners_px;
    corners[k / 4][static_cast<int>(k / 2 % 2)] += k % 2 == 0 ? -kMovePx : kMovePx;
    const auto h = cells_from_px(corners, pattern);
    if (!h) return std::nullopt;
    moved[k] = *h;
  }
  Eigen::Vector2d low = image.corners_px[0];
  Eigen::Vector2d high = low;
  for (const auto& corner : image.corners_px) {
    low = low.cwiseMin(corner);
    high = high.cwiseMax(corner);
  }
  const double beyond = kReachPx + (pattern.cells / pattern.square_cells - 1) * (high - low).maxCoeff();
  const BlurredPattern blurred(pattern);
  const double variance = image.blur_px * image.blur_px + 1.0 / 12;
  Eigen::Matrix<double, kParameters, kParameters> information;
  information.setZero();
  for (int y = static_cast<int>(low.y() - beyond); y <= static_cast<int>(high.y() + beyond); ++y) {
    for (int x = static_cast<int>(low.x() - beyond); x <= static_cast<int>(high.x() + beyond); ++x) {
      const Eigen::Vector3d px(x, y, 1);
      const Eigen::Vector3d p = *homography * px;
      const Eigen::Vector2d u = p.hnormalized();
      Eigen::Matrix2d by_px = homography->topLeftCorner<2, 2>() - u * homography->block<1, 2>(2, 0);
      by_px /= p.z();
      if (!blurred.has_transition(u.x(), u.y(), kReachPx * by_px.row(0).norm(),
                                  kReachPx * by_px.row(1).norm()))
        continue;
      const Eigen::Matrix2d spread = variance * by_px * by_px.transpose();
      const PatternSample s = blurred.sample(u.x(), u.y(), {spread(0, 0), spread(0, 1), spread(1, 1)});
      const double contrast = image.white - image.black;
      const double light = image.black + contrast * s.value;
      const double slope = tone_slope(light, sensor.tone);
      Eigen::Matrix<double, kParameters, 1> row;
      for (std::size_t k = 0; k < 8; ++k) {
        const Eigen::Vector2d by_corner =
            ((moved[2 * k + 1] * px).hnormalized() - (moved[2 * k] * px).hnormalized()) / (2 * kMovePx);
        row[static_cast<int>(k)] = slope * contrast * (s.by_x * by_corner.x() + s.by_y * by_corner.y());
      }
      row[8] = slope * (1 - s.value);
      row[9] = slope * s.value;
      const Eigen::Matrix2d by_variance = by_px * by_px.transpose();
      row[10] = slope * contrast * 0.5 *
                (s.second.xx * by_variance(0, 0) + 2 * s.second.xy * by_variance(0, 1) +
                 s.second.yy * by_variance(1, 1));
      information += row * row.transpose() / encoded_variance(light, slope, sensor);
    }
  }
  const Eigen::LDLT<Eigen::Matrix<double, kParameters, kParameters>> decomposition(information);
  if (!decomposition.isPositive()) return std::nullopt;
  const Eigen::Matrix<double, kParameters, kParameters> covariance =
      decomposition.solve(Eigen::Matrix<double, kParameters, kParameters>::Identity());
  return Eigen::Matrix<double, 8, 8>(covariance.topLeftCorner<8, 8>());
}

}  // namespace hexcal
