#pragma once

#include <vector>

#include "camera_calib/calibrate_camera.h"

namespace hexcal {

/// Lens models with their free terms, from the poorest to the richest; only those of `lens` if it is given.
[[nodiscard]] std::vector<CameraVariant> lens_variants(std::optional<LensModel> lens);

[[nodiscard]] std::string variant_name(const CameraVariant& variant);

/// Fits every variant to the same features with the same noise and ranks them by AICc.
[[nodiscard]] std::vector<ModelTrial> try_variants(const std::vector<Sheet>& sheets,
                                                   const CalibrationState& state, double sigma_px,
                                                   const std::vector<CameraVariant>& variants);

/// Rms in px at photographs that a fit has not seen, over `folds` fits.
[[nodiscard]] double cross_validation_px(const std::vector<Sheet>& sheets, const CalibrationState& state,
                                         const CameraVariant& variant, double sigma_px, int folds);

/// Marks and returns the chosen trial: the best by AICc, or a poorer one (at most the two next ones) whose
/// cross-validation is within 1 % of the best. The poorest such model wins.
std::size_t choose_trial(const std::vector<Sheet>& sheets, const CalibrationState& state, double sigma_px,
                         int folds, std::vector<ModelTrial>& trials);

/// The state with only those views for which keep(photograph) holds.
template <typename Keep>
[[nodiscard]] CalibrationState views_where(const CalibrationState& state, Keep keep) {
  CalibrationState out = state;
  out.views.clear();
  for (const SheetView& view : state.views) {
    if (keep(view.photograph)) out.views.push_back(view);
  }
  return out;
}

}  // namespace hexcal
