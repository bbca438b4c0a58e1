#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "camera_calib/sheet.h"
#include "camera_calib/sheet_observation.h"

namespace hexcal {

/// Where the points of one sheet lie in one photograph, as its markers say, without a camera: near each place
/// by the homography of the markers around it, so that no lens has to be known. Markers count that agree with
/// one another: the largest set that grows from one marker to the next, each of which lies where those beside
/// it predict it. What was misread elsewhere is not in it and harms nothing.
class SheetImage {
 public:
  /// `features`: of this sheet, of any status; those of four points are used.
  SheetImage(const SheetGeometry& geometry, const std::vector<FeatureObservation>& features);

  /// Whether at least two markers agree.
  [[nodiscard]] bool known() const { return places_.size() >= 2; }

  /// Whether at least three markers, and half as many as agree, lie elsewhere than those beside them say:
  /// more than false reads, the markers do not lie as the sheet says.
  [[nodiscard]] bool contradicted() const {
    return disagreeing_ >= 3 && 2 * disagreeing_ >= static_cast<int>(places_.size());
  }

  /// Per feature, whether it is a marker that belongs to the set.
  [[nodiscard]] const std::vector<char>& agrees() const { return agrees_; }

  /// Whether a marker of the set has its centre within `reach_mm` of the place.
  [[nodiscard]] bool has_marker_within(double reach_mm, const Eigen::Vector2d& sheet_mm) const;

  /// Homography from the sheet (mm) to pixels around a place; none where no marker is near, which is 2.5 of
  /// the distances at which markers stand.
  [[nodiscard]] std::optional<Eigen::Matrix3d> around(const Eigen::Vector2d& sheet_mm) const;

 private:
  struct Place {
    Eigen::Vector2d centre_mm;
    double size_mm;
    std::array<Eigen::Vector2d, 4> corners_mm, corners_px;
    std::size_t feature;
  };
  [[nodiscard]] static std::optional<Eigen::Matrix3d> homography_near(const std::vector<Place>& places,
                                                                      const Eigen::Vector2d& sheet_mm,
                                                                      double reach_mm);
  [[nodiscard]] static std::vector<Place> grown_from(const std::vector<Place>& all, std::size_t seed,
                                                     double reach_mm);

  std::vector<Place> places_;  // that agree
  std::vector<char> agrees_;
  double reach_mm_ = 0;
  int disagreeing_ = 0;  // markers in reach of one that agrees which do not
};

}  // namespace hexcal
