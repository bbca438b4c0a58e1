#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <string>
#include <utility>
#include <vector>

#include "camera_calib/sheet_adjustment.h"
#include "camera_calib/sheet_observation.h"
#include "photogrammetry/markers/refine.h"
#include "photogrammetry/photograph/photograph.h"

namespace hexcal {

/// Corners of a marker as a feature.
[[nodiscard]] FeatureObservation feature_of_marker(const MarkerObservation& marker, int sheet,
                                                   int first_point);
[[nodiscard]] std::array<Eigen::Vector2d, 4> marker_corners(const FeatureObservation& feature);

struct SheetDetection {
  std::vector<FeatureObservation>
      features;                     ///< ordered by sheet and point; with a status other than ok if unusable
  std::vector<int> foreign_ids;     ///< ids read that stand on none of the sheets
  std::vector<MarkerRead> markers;  ///< all that were read of the sheets' families
  std::string reason;               ///< why nothing usable was found
};

/// Finds all sheets in a photograph. Sheets with markers may be seen in part and together; a chessboard must
/// be wholly in view, turned as it likes. `grey` is CV_8UC1 or CV_16UC1. Without a camera each photograph's
/// own markers give the lens that is needed to find saddles and dots. Runs in the caller's TBB arena.
[[nodiscard]] SheetDetection detect_sheets(const cv::Mat& grey, ToneCurve tone,
                                           const std::vector<Sheet>& sheets);

/// A photograph's features, and the start for measuring its markers again through another lens.
struct SheetMeasurement {
  std::vector<FeatureObservation> features;  ///< as SheetDetection has them
  std::vector<MarkerGuess> guesses;
  std::vector<std::pair<int, int>> places;  ///< of the guesses: sheet, first point
  Processing processing{ToneResponse(ToneCurve::srgb)};
};

/// Measures at every place where the views, which hold what was detected, predict a feature, with the
/// camera's lens inside the photometric model; markers only roughly.
[[nodiscard]] SheetMeasurement measure_sheets(const cv::Mat& grey, ToneCurve tone,
                                              const std::vector<Sheet>& sheets,
                                              const std::vector<SheetShape>& shapes,
                                              const CameraModel& camera, const std::vector<SheetView>& views);

/// The same markers as well as they can be, through the lens of `camera`.
[[nodiscard]] SheetMeasurement with_markers_measured(const cv::Mat& grey, const CameraModel& camera,
                                                     SheetMeasurement before);

}  // namespace hexcal
