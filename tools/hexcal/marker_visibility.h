#pragma once

#include "kinematics/geometry/pose.h"
#include "photogrammetry/camera/camera_model.h"
#include "tools/io/measured_network.h"

namespace hexcal {

/// Whether a pose can be measured by a camera that stands where it stood for at least half of the poses of a
/// campaign: two photographs or more of such a pose's stations show two moving markers or more, wholly in the
/// picture and by no more than 65 deg from the front. What stands in the way of a marker is not known.
[[nodiscard]] bool can_be_measured(const MeasuredNetwork& network, const CameraModel& camera,
                                   const Pose& pose, double gd_mm);

}  // namespace hexcal
