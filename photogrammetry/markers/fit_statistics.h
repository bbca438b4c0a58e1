#pragma once

#include <Eigen/Core>

#include "photogrammetry/markers/photometric_fit.h"
#include "photogrammetry/markers/pixel_equations.h"

namespace hexcal {

/// What a solved marker tells: corners and centre with their covariances, residuals, levels, and its evidence
/// about the photograph's own parameters. `map`: the photograph's, with the lens as it was fitted;
/// `geometry`: how many of the homography's parameters were free, 8 or 6. Leaves `converged` false where the
/// equations do not determine the parameters.
void complete_fit(const PixelEquations& equations, const ImageVector& parameters, const FitFrame& frame,
                  const PixelMap& map, ToneCurve nominal, int geometry, PhotometricFit& fit);

}  // namespace hexcal
