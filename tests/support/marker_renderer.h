#pragma once

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <vector>

#include "photogrammetry/camera/camera_model.h"
#include "photogrammetry/markers/marker.h"

namespace hexcal::testing {

/// A flat pattern in a test image: its white share over the square's coordinates (+-1 at the corners, x
/// right, y down) as a function of the point and the box (half widths) to average over; none outside what it
/// covers.
struct FlatPattern {
  std::function<double(const Eigen::Vector2d&, const Eigen::Vector2d&)> white;
  Eigen::Matrix3d ideal_from_square;  ///< ideal: pixels, or with a camera normalised coordinates
};

struct TestImage {
  int width_px = 300, height_px = 300;
  double blur_px = 0.7;
  double black = 0.04, white = 0.7;  ///< light
  double noise = 2.0;                ///< of encoded 8-bit values
  Eigen::Vector2d shade_per_px = Eigen::Vector2d::Zero();
  std::function<double(double)> encode;  ///< light to encoded, both 0 to 1; none: sRGB
  std::uint64_t seed = 1;
  const CameraModel* camera = nullptr;
  int oversampling = 8;
};

[[nodiscard]] inline double srgb(double light) {
  if (light <= 0.0031308) return 12.92 * light;
  return 1.055 * std::pow(light, 1 / 2.4) - 0.055;
}

/// White share of a marker's cells averaged over a box, exact for a box along the cells.
[[nodiscard]] inline FlatPattern flat_marker(const MarkerPattern& pattern,
                                             const Eigen::Matrix3d& ideal_from_square) {
  const auto overlap = [](double low, double high, double a, double b) {
    return std::max(0.0, std::min(high, b) - std::max(low, a));
  };
  const auto white = [pattern, overlap](const Eigen::Vector2d& t, const Eigen::Vector2d& half) {
    const double to_cells = 0.5 * pattern.square_cells;
    const double x = t.x() * to_cells + 0.5 * pattern.cells;
    const double y = t.y() * to_cells + 0.5 * pattern.cells;
    const double hx = std::max(half.x() * to_cells, 1e-9);
    const double hy = std::max(half.y() * to_cells, 1e-9);
    double black = 0;
    for (int j = std::max(0, static_cast<int>(std::floor(y - hy)));
         j <= std::min(pattern.cells - 1, static_cast<int>(std::floor(y + hy))); ++j) {
      for (int i = std::max(0, static_cast<int>(std::floor(x - hx)));
           i <= std::min(pattern.cells - 1, static_cast<int>(std::floor(x + hx))); ++i) {
        if (pattern.white[static_cast<std::size_t>(j * pattern.cells + i)] != 0) continue;
        black += overlap(x - hx, x + hx, i, i + 1) * overlap(y - hy, y + hy, j, j + 1);
      }
    }
    return 1 - black / (4 * hx * hy);
  };
  return {white, ideal_from_square};
}

/// Supersampled image of flat patterns on white paper: an independent, slow check of the fit's analytic
/// model.
[[nodiscard]] inline cv::Mat render_image(const TestImage& image, const std::vector<FlatPattern>& patterns) {
  const int n = image.oversampling;
  const int margin = 6;  // px around the frame, for the blur
  const int fine_width = (image.width_px + 2 * margin) * n;
  const int fine_height = (image.height_px + 2 * margin) * n;
  cv::Mat fine(fine_height, fine_width, CV_32F);
  std::vector<Eigen::Matrix3d> square_from_ideal;
  for (const auto& pattern : patterns) square_from_ideal.push_back(pattern.ideal_from_square.inverse());
  const auto ideal_of = [&image](const Eigen::Vector2d& px) -> Eigen::Vector2d {
    return image.camera == nullptr ? px : *image.camera->normalised_from_image(px);
  };
  for (int y = 0; y < fine_height / n; ++y) {
    for (int x = 0; x < fine_width / n; ++x) {
      // Within one pixel the lens is linear.
      const Eigen::Vector2d px(x - margin, y - margin);
      const Eigen::Vector2d middle = ideal_of(px);
      Eigen::Matrix2d by_px;
      by_px.col(0) = ideal_of(px + Eigen::Vector2d(0.5, 0)) - ideal_of(px - Eigen::Vector2d(0.5, 0));
      by_px.col(1) = ideal_of(px + Eigen::Vector2d(0, 0.5)) - ideal_of(px - Eigen::Vector2d(0, 0.5));
      for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i) {
          const Eigen::Vector2d ideal =
              middle + by_px * Eigen::Vector2d((i + 0.5) / n - 0.5, (j + 0.5) / n - 0.5);
          double share = 1;
          for (std::size_t k = 0; k < patterns.size(); ++k) {
            const Eigen::Matrix3d& g = square_from_ideal[k];
            const Eigen::Vector3d h = g * Eigen::Vector3d(ideal.x(), ideal.y(), 1);
            const Eigen::Vector2d t = h.head<2>() / h.z();
            if (!(h.z() * g(2, 2) > 0) || t.cwiseAbs().maxCoeff() > 4) continue;
            Eigen::Matrix2d by_ideal = (g.topLeftCorner<2, 2>() - t * g.block<1, 2>(2, 0)) / h.z();
            const Eigen::Matrix2d step = by_ideal * by_px / n;
            share = std::min(share, patterns[k].white(t, 0.5 * step.cwiseAbs().rowwise().maxCoeff()));
          }
          const double shade =
              1 + image.shade_per_px.dot(px - 0.5 * Eigen::Vector2d(image.width_px, image.height_px));
          fine.at<float>(y * n + j, x * n + i) =
              static_cast<float>((image.black + (image.white - image.black) * share) * shade);
        }
      }
    }
  }
  if (image.blur_px > 0)
    cv::GaussianBlur(fine, fine, {}, image.blur_px * n, image.blur_px * n, cv::BORDER_REPLICATE);
  cv::Mat light;
  cv::resize(fine, light, {fine_width / n, fine_height / n}, 0, 0, cv::INTER_AREA);
  cv::Mat grey(image.height_px, image.width_px, CV_8UC1);
  std::mt19937_64 random(image.seed);
  std::normal_distribution<double> normal;
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      const double value = light.at<float>(y + margin, x + margin);
      const double encoded =
          255 * (image.encode ? image.encode(value) : srgb(value)) + image.noise * normal(random);
      grey.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(std::lround(encoded));
    }
  }
  return grey;
}

/// Homography of a square of `side_px` whose centre is at `centre`, turned by `turn` in the image and then
/// tilted by `tilt` about an axis at `axis` (rad), seen by a pinhole of focal length f_px looking at it.
[[nodiscard]] inline Eigen::Matrix3d tilted_square(const Eigen::Vector2d& centre, double side_px, double turn,
                                                   double tilt, double axis, double f_px = 9000) {
  const Eigen::Vector3d about(std::cos(axis), std::sin(axis), 0);
  const Eigen::Matrix3d rotation =
      (Eigen::AngleAxisd(tilt, about) * Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ())).toRotationMatrix();
  const double distance = 2 * f_px / side_px;  // in half sides
  Eigen::Matrix3d h;
  h.col(0) = rotation.col(0);
  h.col(1) = rotation.col(1);
  h.col(2) = Eigen::Vector3d(0, 0, distance);
  Eigen::Matrix3d k;
  k << f_px, 0, centre.x(), 0, f_px, centre.y(), 0, 0, 1;
  return k * h;
}

[[nodiscard]] inline std::array<Eigen::Vector2d, 4> square_corners(const Eigen::Matrix3d& ideal_from_square) {
  std::array<Eigen::Vector2d, 4> corners;
  static constexpr double kSquare[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  for (std::size_t i = 0; i < 4; ++i) {
    corners[i] = (ideal_from_square * Eigen::Vector3d(kSquare[i][0], kSquare[i][1], 1)).hnormalized();
  }
  return corners;
}

}  // namespace hexcal::testing
