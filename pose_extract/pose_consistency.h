#pragma once

#include <vector>

#include "pose_extract/photo_motions.h"

// Did the moving body stand still while a pose was photographed? Its poses in single photographs scatter by
// the photographs' noise; what they scatter beyond it is motion, or a camera that is not as modelled, and
// belongs into the pose's covariance.

namespace hexcal {

/// What the photographs of one epoch say of each other.
struct EpochConsistency {
  int photos = 0;
  double chi2 = 0;  ///< of the photographs' own poses about their mean, by the noise
  int dof = 0;
  bool stands_out = false;  ///< they scatter more than those of the other epochs
  bool moved = false;       ///< beyond doubt
  double moved_mm = 0;      ///< largest distance, and turn, between two photographs
  double moved_rad = 0;
  /// What it adds to the covariance of the epoch's reference_from_body.
  Matrix6d excess = Matrix6d::Zero();
};

struct CampaignConsistency {
  std::vector<EpochConsistency> epochs;
  double common_mm = 0;  ///< standard deviation per axis that the epochs' photographs have in common beyond
                         ///< the noise, 0 where it does not show
  double common_rad = 0;
};

/// Variance components of the motion between photographs by restricted maximum likelihood (Patterson and
/// Thompson 1971; iteration of Foerstner 1979): one for the campaign from the epochs that agree with each
/// other, one of its own for each that stands out.
[[nodiscard]] CampaignConsistency pose_consistency(const Network& network, const AdjustmentResult& adjusted);

}  // namespace hexcal
