#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "camera_calib/sheet.h"
#include "camera_calib/sheet_observation.h"
#include "photogrammetry/camera/camera_model.h"
#include "photogrammetry/photograph/photograph.h"

namespace hexcal {

/// Markers whose corners were measured through the lens of `before` and would be measured elsewhere through
/// that of `after`: those whose image differs between the two by more than a homography can follow, by index
/// into `features`.
[[nodiscard]] std::vector<std::size_t> markers_bent_otherwise(const std::vector<FeatureObservation>& features,
                                                              const CameraModel& before,
                                                              const CameraModel& after);

/// Measures these again through the lens of `camera`.
void remeasure_markers(const cv::Mat& grey, ToneCurve tone, const std::vector<Sheet>& sheets,
                       const CameraModel& camera, const std::vector<std::size_t>& which,
                       std::vector<FeatureObservation>& features);

}  // namespace hexcal
