#pragma once

#include <optional>
#include <string>
#include <vector>

#include "camera_calib/calibrate_camera.h"
#include "camera_calib/calibrated_camera.h"
#include "camera_calib/projection_difference.h"

namespace hexcal {

/// One photograph's row.
struct PhotographRow {
  std::string name;
  bool used = false;
  std::string status;  ///< "ok", or in words why not or what is odd
  int points = 0;      ///< used
  int rejected = 0;    ///< outliers
  double rms_px = 0;
  double tilt_deg = 0;  ///< between the sheet and the image plane
  double distance_mm = 0;
  double blur_px = 0;  ///< median standard deviation of the point spread, 0 unknown
};

enum class AdviceLevel { note, usable, retake };

/// One sentence of the verdict for the technician.
struct Advice {
  AdviceLevel level = AdviceLevel::note;
  std::string words;
};

/// How the frame is filled: 5 x 5 cells, row by row from the top left.
struct Coverage {
  static constexpr int kSide = 5;
  std::vector<int> points = std::vector<int>(kSide * kSide, 0);
};

struct CameraCorrelation {
  std::string first, second;
  double correlation = 0;
};

/// Everything that can be said about a calibration.
struct CameraReport {
  CameraQuality quality;
  std::vector<PhotographRow> photographs;
  Coverage coverage;
  ProjectionUncertainty uncertainty;
  std::vector<CameraCorrelation> correlations;  ///< over 0.95, cx and cy with pose not included
  std::optional<ProjectionDifference> halves;   ///< between calibrations from every other photograph
  std::vector<Advice> advice;
  Eigen::MatrixXd covariance;  ///< of the camera's parameters, scaled by sigma0
};

[[nodiscard]] CameraReport report_calibration(const std::vector<Sheet>& sheets,
                                              const std::vector<SheetPhotograph>& photographs,
                                              const CameraCalibration& calibration);

}  // namespace hexcal
