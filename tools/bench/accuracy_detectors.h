#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "photogrammetry/markers/detect.h"

namespace hexcal {

/// A way to find markers in a decoded photograph. Corners come back in this project's order and pixels.
struct Detector {
  std::string name;
  bool has_covariance = false;
  bool uses_camera = false;
  std::vector<MarkerObservation> (*detect)(const cv::Mat& grey, const MarkerFamily& family,
                                           const CameraModel* camera);
};

/// This project's without and with the lens known, libapriltag at full and half resolution with its own
/// refinement, and OpenCV's aruco with each of its refinements; the libraries' half pixels are taken off. The
/// others know tag36h11 only.
[[nodiscard]] const std::vector<Detector>& detectors();

}  // namespace hexcal
