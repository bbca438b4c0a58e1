#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pose_extract/nominal_points.h"

// What people get wrong in tables of nominal coordinates, tried one by one on the measured markers.

namespace hexcal {

/// A median misfit beyond this is no placement by hand: along a printed or drawn line stickers lie to 0.3 to
/// 0.5 mm, and half of them four times as far off is another cause. Rougher coordinates state their sigma_mm.
inline constexpr double kBeyondHandMm = 2;

/// Coordinates and the markers' size_mm that differ by more are of two units or things, no print.
inline constexpr double kBeyondPrinter = 0.1;

/// A slip under which the coordinates fit.
struct NominalSlip {
  std::string words;        ///< what the coordinates are: "mirrored: x and y are exchanged"
  std::string instruction;  ///< what to do about it
  double left_mm = 0;       ///< misfit that is left of most points
};

/// The slip that explains best why `nominal` misses the markers by `as_listed`; none if none does, or if
/// without one they fit nearly as well. Tried: units, axes of other sign or exchanged, ids that are shifted
/// or in reverse order, corners that are counted from another one or the other way.
[[nodiscard]] std::optional<NominalSlip> find_slip(const Network& network, const AdjustmentResult& adjusted,
                                                   int body, const std::vector<NominalPoint>& nominal,
                                                   double as_listed_mm, double limit_mm);

/// One sentence for every sticker or point that the fit left out: where it lies, and which slip of its own
/// explains that.
[[nodiscard]] std::vector<std::string> words_of_left_out(const std::vector<NominalSticker>& stickers,
                                                         const NominalFit& fit);

}  // namespace hexcal
