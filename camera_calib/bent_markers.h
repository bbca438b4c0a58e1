#pragma once

#include <vector>

#include "camera_calib/sheet_observation.h"
#include "photogrammetry/camera/camera_model.h"

namespace hexcal {

/// Whether any of the markers, whose corners were measured through the lens of `before`, would be measured
/// elsewhere through that of `after`: its image differs between the two by more than a homography can follow
/// and than a third of its corners' sigma.
[[nodiscard]] bool bent_otherwise(const std::vector<FeatureObservation>& features, const CameraModel& before,
                                  const CameraModel& after);

}  // namespace hexcal
