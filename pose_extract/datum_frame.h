#pragma once

#include <string>
#include <vector>

#include "photogrammetry/adjustment/adjustment.h"
#include "pose_extract/nominal_points.h"

namespace hexcal {

/// How far a point lies from where its frame's definition puts it.
struct DatumResidual {
  MarkerPoint point;
  Eigen::Vector3d residual_mm =
      Eigen::Vector3d::Zero();  ///< measured minus nominal, or distance from the feature
  double sigma_mm = 0;          ///< expected size per axis
  bool used = true;             ///< false: rejected as wrong, or a sticker that is lifted
};

/// A body's datum frame. Its error, a perturbation of frame_from_body as in covariance.h with the relative
/// error of `scale` as seventh entry, is by_error times the errors of the adjustment (adjustment_result.h)
/// plus own noise.
struct DatumFrame {
  bool ok = false;
  std::string reason = "not defined";  ///< why it is not ok
  std::string instruction;             ///< what to do about that
  std::string contradiction;           ///< what makes all poses that hang on it suspect; empty: nothing
  Rigid3 frame_from_body;              ///< applied to the body's coordinates times scale
  double scale = 1;                    ///< from nominal coordinates when asked for
  Eigen::Matrix<double, 7, Eigen::Dynamic> by_error;
  Eigen::Matrix<double, 7, 7> own = Eigen::Matrix<double, 7, 7>::Zero();
  Placement placement;  ///< of its stickers, beyond the sigmas stated: in `own`
  std::vector<DatumResidual> residuals;
  std::vector<std::string> notes;  ///< form errors (flatness, roundness), rejected points
};

/// Weighted best fit (Helmert; with_scale adds the seventh parameter) of a body's measured points to nominal
/// coordinates, never warping them; robust to wrong ones, which are listed. What the fit leaves says how its
/// stickers were placed, where no sigma states it or the stated ones are contradicted. Coordinates that no
/// placement by hand explains, or that a slip explains far better (nominal_slips.h), make no frame.
[[nodiscard]] DatumFrame frame_from_nominal(const Network& network, const AdjustmentResult& adjusted,
                                            int body, const std::vector<NominalPoint>& nominal,
                                            bool with_scale);

/// 3-2-1 frame from features (plane, line, circle, cylinder, sphere, point), see FeatureFrame.
[[nodiscard]] DatumFrame frame_from_features(const Network& network, const AdjustmentResult& adjusted,
                                             int body, const FeatureFrame& features);

/// UG where nothing is known but what the photographs show: origin at the mean of the fixed markers' centres,
/// z from the mean of the moving ones at home towards it, y away from who stands before the fixed markers
/// (the side to which they face on average; where they face all around, that of the lowest), x to his right.
/// Or a frame that stands in that one at markers_from_frame.
[[nodiscard]] DatumFrame frame_from_markers(const Network& network, const AdjustmentResult& adjusted,
                                            int home_epoch, const Rigid3& markers_from_frame = {});

/// Frame of the lowest marker of a body: for projects that define none.
[[nodiscard]] DatumFrame frame_from_first_marker(const Network& network, const AdjustmentResult& adjusted,
                                                 int body);

/// Index of a marker in the network; -1 if it is not there or was not measured.
[[nodiscard]] int measured_marker(const Network& network, const AdjustmentResult& adjusted, int body, int id);

}  // namespace hexcal
