#pragma once

#include <vector>

#include "photogrammetry/adjustment/adjustment.h"
#include "photogrammetry/adjustment/outlier_test.h"

namespace hexcal {

/// Puts the covariances of an epoch and its photographs, in all common columns, into the result.
void export_covariances(const EpochElimination& elimination, std::size_t epoch, AdjustmentResult& result);

/// Residuals in px, redundancy and their summaries per photograph, marker and epoch; ambiguous photographs.
void summarise_residuals(const Network& network, const std::vector<SightingTest>& tests,
                         AdjustmentResult& result);

}  // namespace hexcal
