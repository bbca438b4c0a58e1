#pragma once

#include <array>
#include <vector>

#include "photogrammetry/adjustment/network.h"

namespace hexcal {

using Vector8d = Eigen::Matrix<double, 8, 1>;
using Matrix8d = Eigen::Matrix<double, 8, 8>;
using Matrix86d = Eigen::Matrix<double, 8, 6>;
using Matrix6Xd = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// Why an observed feature stands outside the adjustment.
enum class SightingStatus {
  used,
  not_measured,  ///< the detector's own status is not ok, or the number of points is not the feature's
  unknown_id,    ///< no feature of the campaign
  repeated_id,   ///< the same id twice in the photograph
  seen_once,     ///< its feature is in no other photograph
  unoriented,    ///< its photograph, pose or feature is not connected with the rest
  outlier,       ///< does not agree with the rest: moved, mislabelled or disturbed
};

/// One feature in one photograph as the adjustment sees it. Vectors have two rows per point; what is beyond
/// the feature's points is zero, so that one size fits all.
struct Sighting {
  int photo = 0;
  int feature = -1;  ///< index into Network::features
  SightingStatus status = SightingStatus::used;
  int points = 4;
  Vector8d px = Vector8d::Zero();
  Matrix8d covariance_px2 = Matrix8d::Zero();
  std::array<bool, kMaxFeaturePoints> point_used{true, true, true, true};
  /// Rows 0..rows-1 take a displacement of all points to independent unit residuals of the used ones.
  Matrix8d whitener = Matrix8d::Zero();
  int rows = 8;
  double side_px = 0;  ///< mean distance of neighbouring points
};

/// Whitener of the used points from the covariance; false if that is not positive definite.
bool whiten(Sighting& sighting);

/// All points used again.
bool use_all_points(Sighting& sighting);

/// All observations of a network in the order of photos and their observations; those that cannot be used are
/// marked. A feature that is known on its body may be seen once.
[[nodiscard]] std::vector<Sighting> collect_sightings(const Network& network);

}  // namespace hexcal
