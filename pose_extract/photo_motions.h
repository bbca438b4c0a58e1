#pragma once

#include <vector>

#include "photogrammetry/adjustment/adjustment_result.h"

namespace hexcal {

/// Where one photograph alone puts the moving body, relative to where the whole epoch has it.
struct PhotoMotion {
  std::size_t photo = 0;
  std::size_t epoch = 0;
  /// Perturbation of the epoch's reference_from_body, as a translation of the middle of the moving markers
  /// (mm) and a rotation about it (rad).
  Vector6d motion = Vector6d::Zero();
  Matrix6d information = Matrix6d::Zero();  ///< inverse covariance of motion by the photograph's noise
  bool in_pose = true;  ///< false: most of its moving markers were rejected, so that the pose is without it
};

struct PhotoMotions {
  std::vector<PhotoMotion> motions;  ///< of the photographs that show both bodies, in their order
  /// Variance factor of the photographs' noise where the body may move between them: at most sigma0 squared,
  /// which an unsteady body makes larger.
  double noise_factor = 1;
};

/// Every photograph's own pose of the moving body: its station and that pose are fitted to its sightings
/// alone, on the markers' places as adjusted. A photograph whose moving markers were mostly rejected is
/// fitted with the rejected ones.
[[nodiscard]] PhotoMotions photo_motions(const Network& network, const AdjustmentResult& adjusted);

/// From a perturbation of reference_from_body to one about the middle of the moving markers.
[[nodiscard]] Matrix6d about_middle(const Network& network, const NetworkGeometry& geometry,
                                    std::size_t epoch);

}  // namespace hexcal
