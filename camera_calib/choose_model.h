#pragma once

#include <vector>

#include "camera_calib/calibrate_camera.h"

namespace hexcal {

/// Lens models with their free terms, from the poorest to the richest; only those of `lens` if it is given.
[[nodiscard]] std::vector<CameraVariant> lens_variants(std::optional<LensModel> lens);

[[nodiscard]] std::string variant_name(const CameraVariant& variant);

/// Fits every variant to the same features with the same noise. Runs in the caller's TBB arena; the result
/// does not depend on the number of threads.
[[nodiscard]] std::vector<ModelTrial> try_variants(const std::vector<Sheet>& sheets,
                                                   const CalibrationState& state, double sigma_px,
                                                   const std::vector<CameraVariant>& variants);

/// Marks and returns the chosen trial: the poorest whose photographs left out one by one fit no worse than
/// with the best, as far as the spread between photographs can tell (the one-standard-error rule, Breiman et
/// al. 1984, on paired differences). With fewer than five photographs the best by AICc.
std::size_t choose_trial(std::vector<ModelTrial>& trials);

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
