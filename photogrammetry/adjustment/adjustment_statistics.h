#pragma once

#include <vector>

#include "photogrammetry/adjustment/adjustment.h"
#include "photogrammetry/adjustment/outlier_test.h"

namespace hexcal {

/// Residuals in px, redundancy and their summaries per photograph, feature and epoch.
void summarise_residuals(const Network& network, const std::vector<SightingTest>& tests,
                         AdjustmentResult& result);

}  // namespace hexcal
