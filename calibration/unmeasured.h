#pragma once

#include "calibration/method_comparison.h"

namespace hexcal {

/// Where the held-out poses were not measured in all six coordinates, cross-validation sees only part of the
/// error: statistics of what was not measured become NaN (no number, never zero), and the choice follows the
/// predicted error over all six. A coordinate that was not measured counts with the squared difference
/// between what the method and the identified geometry expect there, plus the latter's variance: parameters
/// that the data do not tell keep their tolerances. Nothing changes where all were measured. Where
/// `frames_unknown` methods are not comparable so, and the choice stays.
void count_unmeasured(const PlatformGeometry& nominal, const ObservationSet& observations,
                      bool frames_unknown, MethodComparison& comparison);

}  // namespace hexcal
