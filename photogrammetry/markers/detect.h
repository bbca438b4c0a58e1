#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "photogrammetry/camera/camera_model.h"
#include "photogrammetry/markers/marker.h"
#include "photogrammetry/markers/refine.h"
#include "photogrammetry/photograph/photograph.h"

namespace hexcal {

struct DetectionOptions {
  /// Ids to look for; none: all of the family. Fewer ids make a false one less likely.
  std::vector<int> ids;
  RefineOptions refine;

  /// Throws InputError naming field and value.
  void validate() const;
};

/// Finds and measures all markers of a family in one photograph, sorted by id. Markers that were read but
/// cannot be trusted are in the list with their status. With a camera its lens stands inside the photometric
/// model; without one, the photograph's own markers estimate a common radial distortion (a nuisance, good
/// enough for corners before calibration). `grey` is CV_8UC1 or CV_16UC1. Runs in the caller's TBB arena; the
/// result does not depend on the number of threads.
[[nodiscard]] std::vector<MarkerObservation> detect_markers(const cv::Mat& grey, ToneCurve tone,
                                                            const MarkerFamily& family,
                                                            const DetectionOptions& options = {},
                                                            const CameraModel* camera = nullptr);

/// What of one family can be read in a photograph.
struct FamilyReading {
  std::string family;
  std::vector<MarkerObservation>
      markers;  ///< sorted by id; corners as found, within about 2 px, not measured
};

/// Reads, without measuring, the markers of several families; only those without a wrong cell, so that one
/// family's markers are seldom another's. For questions such as which family was printed.
[[nodiscard]] std::vector<FamilyReading> read_families(const cv::Mat& grey, ToneCurve tone,
                                                       const std::vector<std::string>& families);

/// One photograph as the later stages see it: no pixels.
struct PhotographObservations {
  std::string name;  ///< as given by the user, for instance relative to the image folder
  std::string sha256;
  PhotographStatus status = PhotographStatus::unreadable;
  std::string reason;  ///< why status is not ok
  PhotographInfo info;
  std::vector<MarkerObservation> markers;  ///< sorted by id
};

/// The same for a photograph that was read; a bad photograph gives its status and no markers.
[[nodiscard]] PhotographObservations observe_photograph(const Photograph& photograph,
                                                        const MarkerFamily& family,
                                                        const DetectionOptions& options = {},
                                                        const CameraModel* camera = nullptr);

}  // namespace hexcal
