#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "pose_extract/campaign.h"

namespace hexcal {

/// A geometric feature fitted to points.
struct FittedFeature {
  bool ok = false;
  std::string reason = "not fitted";
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< centroid, circle or sphere centre, point of the axis
                                                    ///< next to the centroid
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< unit normal or axis; zero for point and sphere
  double radius_mm = 0;                                 ///< circle, cylinder, sphere
  std::vector<double> distance_mm;                      ///< per point: signed distance from the feature
  std::vector<char> used;    ///< per point: 0 when it was left out as not lying on it
  double form_error_mm = 0;  ///< largest minus smallest distance of the used points
};

/// Points that lie on a feature within `tolerance_mm`, found by random sample consensus (Fischler and Bolles
/// 1981, as in PCL); all points for kinds that need none of it (point) or when there are too few to choose
/// from.
[[nodiscard]] std::vector<char> consensus_points(Feature::Kind kind, const Eigen::Matrix3Xd& points,
                                                 double tolerance_mm);

/// Weighted least squares on the points of the consensus, weights 1 / sigma_mm^2; `normals` (3 x n) are the
/// faces' outward normals where the points lie, which start a cylinder's axis. `centres` (3 x n) are the
/// centres of the markers that the points belong to, or the points themselves: a cylinder's distances are
/// taken along the radius through the centre, so that a flat sticker on the side of a prism counts with its
/// plane and needs not be glued in the middle of it.
[[nodiscard]] FittedFeature fit_feature(Feature::Kind kind, const Eigen::Matrix3Xd& points,
                                        const Eigen::VectorXd& sigma_mm, const Eigen::Matrix3Xd& normals,
                                        const Eigen::Matrix3Xd& centres, const std::vector<char>& used);

}  // namespace hexcal
