#pragma once

#include <Eigen/Core>
#include <vector>

#include "photogrammetry/camera/camera_model.h"

namespace hexcal {

/// The inverse of a lens as a table: normalised coordinates of any pixel by cubic interpolation between nodes
/// 8 px apart, within 1e-4 px of CameraModel::normalised_from_image.
class RayLattice {
 public:
  /// Throws InputError if the lens has no inverse somewhere in the frame.
  explicit RayLattice(const CameraModel& camera);

  /// Rays of the pixel positions first + (column, row), row by row into `rays` (resized).
  void rays(const Eigen::Vector2d& first_px, int columns, int rows, std::vector<Eigen::Vector2d>& rays) const;
  [[nodiscard]] Eigen::Vector2d at(const Eigen::Vector2d& px) const;

  [[nodiscard]] const CameraModel& camera() const { return camera_; }

 private:
  CameraModel camera_;
  int columns_ = 0;
  int rows_ = 0;
  std::vector<Eigen::Vector2d> nodes_;
};

}  // namespace hexcal
