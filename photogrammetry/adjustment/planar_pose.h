#pragma once

#include <array>
#include <vector>

#include "photogrammetry/adjustment/projection.h"

namespace hexcal {

/// One of the poses under which a square marker gives its image.
struct PlanarPose {
  Rigid3 camera_from_marker;
  double rms_px = 0;  ///< of the eight coordinates
};

/// The two poses (best first) of a square marker from its four corners: closed form from the homography's
/// first-order behaviour at the centre (Collins and Bartoli, "Infinitesimal plane-based pose estimation",
/// 2014), each then refined on the pixels. A plane seen from far has two near-solutions, mirrored about the
/// line of sight; which one is true must be decided from other markers or photographs. One or none where the
/// image allows no more.
[[nodiscard]] std::vector<PlanarPose> planar_marker_poses(const CameraModel& camera,
                                                          const Vector8d& corners_px,
                                                          const NetworkFeature& square);

}  // namespace hexcal
