#pragma once

#include "photogrammetry/adjustment/adjustment_result.h"
#include "photogrammetry/adjustment/network.h"

namespace hexcal {

struct AdjustmentOptions {
  /// refined: the calibration's covariance is the prior of the interior orientation. fixed: it keeps its
  /// values, and the covariance goes into that of every result.
  enum class Interior { refined, fixed };
  Interior interior = Interior::refined;
  /// Rigid squares, or corners free within the priors below; automatic decides by an F test.
  enum class Shape { automatic, rigid, free };
  Shape shape = Shape::automatic;
  double squareness_sigma_mm = 0.03;  ///< a laser print's edges and angles; at most this, fitted below
  double flatness_sigma_mm = 0.03;    ///< a sticker's corners out of its plane; likewise
  bool print_scale_free = false;      ///< true: scale from Network::lengths; false: from the markers' sizes
  /// Relative sigma of what all stated sizes are off by in common, when print_scale_free is false. What each
  /// is off by of its own is fitted to the photographs (SquareMode::kSquareSize).
  double print_scale_sigma = 0;
  /// Probability that the largest outlier statistic of a marker rejects it wrongly.
  double outlier_probability = 1e-6;

  /// Throws InputError naming the option and its value.
  void validate() const;
};

/// Bundle adjustment of a whole campaign (Triggs et al. 2000; Förstner and Wrobel 2016, ch. 15): camera pose
/// per photograph, pose of the moving body per epoch, pose (and shape) of every marker, interior orientation.
/// Observations are whitened by their 8x8 covariances. Camera and body poses are eliminated epoch by epoch,
/// which costs time proportional to the number of photographs and gives the covariances of all poses in
/// closed form; that is why the normal equations are reduced here and not by a general solver. Bad
/// observations get a status; never throws for data.
[[nodiscard]] AdjustmentResult adjust_network(const Network& network, const AdjustmentOptions& options);

}  // namespace hexcal
