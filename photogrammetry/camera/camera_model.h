#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace hexcal {

/// How the lens bends rays. Normalised coordinates (x, y) = (X/Z, Y/Z), r^2 = x^2 + y^2:
///   brown     g = 1 + k1 r^2 + k2 r^4 + k3 r^6; parameters k1 k2 p1 p2 k3
///   rational  g = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6), thin prism;
///             parameters k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4
///   radial    g = 1 + a1 r + a2 r^2 + ... + a6 r^6; parameters a1 .. a6 p1 p2
/// The first two in OpenCV's order.
/// distorted = (x, y) g + decentring (p1, p2; Brown 1966) + thin prism (s1 r^2 + s2 r^4, s3 r^2 + s4 r^4), as
/// in OpenCV.
enum class LensModel { brown, rational, radial };

[[nodiscard]] std::string_view lens_model_name(LensModel lens);
[[nodiscard]] std::optional<LensModel> lens_model_from_name(std::string_view name);

/// Interior orientation of a camera. Pixel (0, 0) is the centre of the top-left pixel; +x right, +y down, +z
/// forward.
struct CameraModel {
  static constexpr int kNumPinhole = 4;  ///< f_px, affinity, cx_px, cy_px
  static constexpr int kMaxParameters = 16;
  using Parameters = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxParameters, 1>;
  using ByParameters = Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, kMaxParameters>;

  int width_px = 0;
  int height_px = 0;
  LensModel lens = LensModel::brown;
  /// f_px, affinity b (fx = f (1 + b), fy = f), cx_px, cy_px, then the lens parameters of `lens`.
  Parameters parameters;
  /// Largest undistorted radius r for which the model was fitted; project() gives nothing beyond, where a
  /// polynomial may turn back into the frame.
  double valid_radius = std::numeric_limits<double>::infinity();

  CameraModel() = default;
  /// Camera without distortion and with its principal point at the middle of the frame.
  CameraModel(int width, int height, double f_px, LensModel lens_model = LensModel::brown);

  [[nodiscard]] double fx_px() const { return parameters[0] * (1.0 + parameters[1]); }
  [[nodiscard]] double fy_px() const { return parameters[0]; }
  [[nodiscard]] double cx_px() const { return parameters[2]; }
  [[nodiscard]] double cy_px() const { return parameters[3]; }

  /// Lens distortion in normalised coordinates, without the pinhole part.
  [[nodiscard]] Eigen::Vector2d distort(const Eigen::Vector2d& normalised) const;

  /// Pixel of a direction (x, y, 1).
  [[nodiscard]] Eigen::Vector2d image_from_normalised(const Eigen::Vector2d& normalised) const;

  /// The same with its 2x2 Jacobian by the normalised coordinates and, if asked, by `parameters` (2 x count).
  [[nodiscard]] Eigen::Vector2d image_from_normalised(const Eigen::Vector2d& normalised,
                                                      Eigen::Matrix2d* by_point,
                                                      ByParameters* by_parameters) const;

  /// Normalised coordinates whose image is `px` (Newton, to 1e-13); none where the lens model has no inverse.
  [[nodiscard]] std::optional<Eigen::Vector2d> normalised_from_image(const Eigen::Vector2d& px) const;

  /// Pixel of a point in the camera frame (mm); none behind the camera or beyond `valid_radius`.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_in_camera) const;

  [[nodiscard]] bool contains(const Eigen::Vector2d& px, double margin_px = 0.0) const {
    return px.x() >= margin_px - 0.5 && px.y() >= margin_px - 0.5 && px.x() <= width_px - 0.5 - margin_px &&
           px.y() <= height_px - 0.5 - margin_px;
  }
};

/// Names of `parameters` in their order: f_px, affinity, cx_px, cy_px, k1, ...
[[nodiscard]] const std::vector<std::string>& camera_parameter_names(LensModel lens);

}  // namespace hexcal
