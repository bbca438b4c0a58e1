#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core/types.hpp>
#include <optional>

#include "photogrammetry/camera/camera_model.h"

namespace hexcal {

/// Stand-in for an unknown lens: ideal = offset (1 + k1 r^2 + k2 r^4), offset from the frame's middle, r in
/// half diagonals of the frame.
struct LensStandIn {
  double k1 = 0, k2 = 0;
};

/// Maps pixels of one photograph to ideal pixels, in which straight lines are straight: a pinhole camera of
/// the same focal length, origin at its principal point (or at the frame's middle without a camera).
class PixelMap {
 public:
  explicit PixelMap(const CameraModel& camera) : camera_(&camera) {}
  PixelMap(int width_px, int height_px, const LensStandIn& lens);

  [[nodiscard]] bool has_camera() const { return camera_ != nullptr; }
  [[nodiscard]] const LensStandIn& stand_in() const { return lens_; }

  /// None where the lens model has no inverse.
  [[nodiscard]] std::optional<Eigen::Vector2d> ideal_from_pixel(const Eigen::Vector2d& px) const;
  /// Pixel and its Jacobian by the ideal point.
  [[nodiscard]] Eigen::Vector2d pixel_from_ideal(const Eigen::Vector2d& ideal,
                                                 Eigen::Matrix2d* by_ideal) const;

  /// Derivatives of the ideal point by k1 and k2 (columns); without a camera only.
  [[nodiscard]] Eigen::Matrix2d by_stand_in(const Eigen::Vector2d& px) const;

 private:
  const CameraModel* camera_ = nullptr;
  Eigen::Vector2d centre_ = Eigen::Vector2d::Zero();
  double per_half_diagonal_ = 1;
  LensStandIn lens_;
};

/// A PixelMap over one marker as a polynomial of fifth order in x and y, fast to follow along a row of
/// pixels.
class PixelMapPatch {
 public:
  /// None if the map is not defined everywhere in the box (which is grown to at least 8 px a side).
  [[nodiscard]] static std::optional<PixelMapPatch> fit(const PixelMap& map, const cv::Rect& box);

  struct Point {
    Eigen::Vector2d ideal;
    Eigen::Matrix2d by_px;
  };
  /// One row of pixels: polynomials in x.
  class Row {
   public:
    [[nodiscard]] Point at(double x_px) const;

   private:
    friend class PixelMapPatch;
    Eigen::Matrix<double, 4, 6> coefficients_;  // ideal x, y and their derivatives by y
    double middle_ = 0, half_ = 1;
  };
  [[nodiscard]] Row row(double y_px) const;

 private:
  Eigen::Vector2d middle_, half_;
  std::array<Eigen::Matrix<double, 6, 6>, 2> coefficients_;  // of x^i y^j, on [-1, 1]
};

}  // namespace hexcal
