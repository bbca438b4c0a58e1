#pragma once

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "camera_calib/sheet_adjustment.h"
#include "kinematics/geometry/pose.h"

namespace hexcal {

/// Observations of a sheet from photographs around it, aimed at changing parts of the frame so that many are
/// partial views.
struct SyntheticSheets {
  CameraModel camera;
  SheetShape shape;  ///< as printed
  int photographs = 14;
  double sigma_px = 0;  ///< of every coordinate; the stated covariance is that of 0.01 px where this is zero
  double tilt_deg = 35;
  unsigned seed = 1;
};

inline Sheet synthetic_aprilgrid() {
  Sheet sheet;
  sheet.kind = SheetKind::aprilgrid;
  sheet.family = "tag36h11";
  sheet.columns = 8;
  sheet.rows = 6;
  sheet.marker_mm = 40;
  sheet.spacing_mm = 15;
  return sheet;
}

/// The 18-105 lens at 35 mm in the terms of its public profile (odd and even powers), or at 105 mm.
inline CameraModel profile_camera(double focal_mm = 35) {
  CameraModel camera(6016, 4000, 9011.1, LensModel::radial);
  camera.parameters.segment<3>(CameraModel::kNumPinhole) << 0.015862, -0.071374, 0.645894;
  if (focal_mm == 105) {
    camera.parameters[0] = 27371.9;
    camera.parameters.segment<3>(CameraModel::kNumPinhole) << -0.349949, 3.793953, -0.625429;
  }
  camera.parameters[2] += 14.2;
  camera.parameters[3] -= 9.7;
  return camera;
}

inline double gaussian(std::mt19937& random) { return std::normal_distribution<double>()(random); }

inline std::vector<SheetPhotograph> synthetic_photographs(const Sheet& sheet,
                                                          const SyntheticSheets& options) {
  std::mt19937 random(options.seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const SheetGeometry geometry = sheet_geometry(sheet);
  const std::vector<Eigen::Vector3d> points = shaped_points(sheet, options.shape);
  const CameraModel& camera = options.camera;
  std::vector<SheetPhotograph> out;
  for (int p = 0; p < options.photographs; ++p) {
    SheetPhotograph photograph;
    photograph.name = "photo" + std::to_string(p);
    photograph.status = PhotographStatus::ok;
    photograph.info.width_px = camera.width_px;
    photograph.info.height_px = camera.height_px;
    // As large as the frame, tilted about changing axes, pushed towards changing sides; every third one
    // turned.
    const double turn = (p % 3 == 2 ? 90 : 0) + 5 * uniform(random);
    const double about = 2.399963 * p;
    const Eigen::Vector3d rotation = options.tilt_deg * kRadPerDeg * (p % 4 == 3 ? 0.3 : 1.0) *
                                     Eigen::Vector3d(std::cos(about), std::sin(about), 0);
    const Eigen::Quaterniond facing(0, 1, 0, 0);  // half a turn about x: the sheet's z looks at the camera
    const Eigen::Quaterniond q =
        quaternion_from_rotation_vector(rotation) * facing * quaternion_from_rpy({0, 0, turn * kRadPerDeg});
    const double distance =
        0.9 * camera.fy_px() * geometry.extent_mm.x() / camera.width_px * (1 + 0.15 * uniform(random));
    const Eigen::Vector3d t(0.25 * geometry.extent_mm.x() * std::cos(1.3 * p),
                            0.25 * geometry.extent_mm.y() * std::sin(1.3 * p), distance);
    const Rigid3 camera_from_sheet(q, t);
    for (std::size_t first = 0; first + 3 < points.size(); first += 4) {
      FeatureObservation feature;
      feature.first_point = static_cast<int>(first);
      feature.px.resize(8);
      bool inside = true;
      for (std::size_t i = 0; i < 4; ++i) {
        const auto px = camera.project(camera_from_sheet * points[first + i]);
        inside = inside && px && camera.contains(*px, 5);
        if (px) feature.px.segment<2>(static_cast<Eigen::Index>(2 * i)) = *px;
      }
      if (!inside) continue;
      for (Eigen::Index i = 0; i < 8; ++i) feature.px[i] += options.sigma_px * gaussian(random);
      const double sigma = options.sigma_px > 0 ? options.sigma_px : 0.01;
      feature.covariance_px2 = sigma * sigma * FeatureObservation::Matrix::Identity(8, 8);
      photograph.features.push_back(feature);
    }
    out.push_back(photograph);
  }
  return out;
}

}  // namespace hexcal
