#pragma once

#include <optional>
#include <string>
#include <vector>

#include "camera_calib/robust_fit.h"
#include "camera_calib/sheet_observation.h"

namespace hexcal {

struct CameraCalibrationOptions {
  std::optional<LensModel> lens;      ///< none: chosen by evidence
  std::optional<BoardFreedom> board;  ///< none: chosen by evidence
  std::optional<double> f_hint_px;    ///< from EXIF; used only where the views hardly determine f

  /// Throws InputError naming field and value.
  void validate() const;
};

/// One model that was tried, with its evidence.
struct ModelTrial {
  std::string name;  ///< "brown k1 k2 p1 p2 k3, board warped"
  CameraVariant variant;
  double chi2 = 0;
  int unknowns = 0;
  double aicc = 0;  ///< corrected Akaike criterion (Hurvich & Tsai 1989), relative to the best
  std::vector<double> left_out_chi2;          ///< per photograph, by a camera that has not seen it
  std::optional<double> cross_validation_px;  ///< rms of the same in px
  bool chosen = false;
};

enum class CalibrationStatus { no_sheet, other_sheet, too_few_photographs, no_solution, ok };

struct CameraCalibration {
  CalibrationStatus status = CalibrationStatus::no_sheet;
  std::string reason;  ///< why status is not ok, or none
  RobustFitResult fit;
  CameraVariant variant;
  std::vector<ModelTrial> trials;
};

/// From photographs to a Brown camera good to about a pixel, poses included: what the second measurement
/// needs.
[[nodiscard]] CameraCalibration rough_calibration(const std::vector<Sheet>& sheets,
                                                  const std::vector<SheetPhotograph>& photographs,
                                                  const CameraCalibrationOptions& options = {});

/// The same cameras, poses and shapes with the features of `photographs`; views without usable ones go.
[[nodiscard]] CalibrationState with_features(const CalibrationState& state,
                                             const std::vector<SheetPhotograph>& photographs);

/// The full calibration from a rough one: lens model and freedom of the sheets are chosen by the corrected
/// Akaike criterion and by cross-validation over photographs, unless the options say which (choose_model.h).
[[nodiscard]] CameraCalibration calibrate_camera(const std::vector<Sheet>& sheets,
                                                 const CalibrationState& rough, double rough_sigma_px,
                                                 const CameraCalibrationOptions& options = {});

}  // namespace hexcal
