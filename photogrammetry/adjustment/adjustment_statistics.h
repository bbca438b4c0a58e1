#pragma once

#include <vector>

#include "photogrammetry/adjustment/adjustment.h"
#include "photogrammetry/adjustment/outlier_test.h"

namespace hexcal {

/// Puts the covariances of epochs and photographs, in all common columns, into the result.
void export_covariances(const Network& network, const BundleSystem& system, AdjustmentResult& result);

/// Residuals in px, redundancy and their summaries per photograph, marker and epoch; ambiguous photographs.
void summarise_residuals(const Network& network, const std::vector<SightingTest>& tests,
                         AdjustmentResult& result);

}  // namespace hexcal
