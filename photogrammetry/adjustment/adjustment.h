#pragma once

#include <string>
#include <vector>

#include "photogrammetry/adjustment/bundle_system.h"
#include "photogrammetry/adjustment/network.h"
#include "photogrammetry/adjustment/sighting.h"

namespace hexcal {

struct AdjustmentOptions {
  /// refined: the calibration's covariance is the prior of the interior orientation. fixed: it keeps its
  /// values, and the covariance goes into that of every result.
  enum class Interior { refined, fixed };
  Interior interior = Interior::refined;
  /// Rigid squares, or corners free within the priors below; automatic decides by an F test.
  enum class Shape { automatic, rigid, free };
  Shape shape = Shape::automatic;
  double squareness_sigma_mm = 0.03;  ///< a laser print's edges and angles
  double flatness_sigma_mm = 0.03;    ///< a sticker's corners out of its plane
  bool print_scale_free = false;      ///< true: scale from Network::lengths; false: from the markers' sizes
  double print_scale_sigma = 0;  ///< relative; how well the sizes are known when print_scale_free is false
  /// Probability that the largest outlier statistic of a marker rejects it wrongly.
  double outlier_probability = 1e-6;

  /// Throws InputError naming the option and its value.
  void validate() const;
};

enum class AdjustmentStatus { ok, nothing_connected, not_converged, no_redundancy };

/// Residuals of a group of sightings.
struct ResidualSummary {
  int markers = 0;        ///< sightings used
  int rejected = 0;       ///< sightings taken out as outliers
  double rms_px = 0;      ///< per coordinate
  double worst_px = 0;    ///< largest corner residual
  double redundancy = 0;  ///< share of the observations that is checked by the others, 0 to 1
};

/// How the error of an epoch's fixed_from_moving (perturbation of covariance.h) comes about: own noise of
/// covariance `own`, minus by_common times the error of the common parameters.
struct EpochCovariance {
  Matrix6d own = Matrix6d::Zero();
  Matrix6Xd by_common;
};

/// The same of a photograph's camera_from_fixed, given its epoch.
struct PhotoCovariance {
  Matrix6d own = Matrix6d::Zero();
  Matrix6d by_epoch = Matrix6d::Zero();
  Matrix6Xd by_common;
};

struct AdjustmentResult {
  AdjustmentStatus status = AdjustmentStatus::nothing_connected;
  std::string reason = "not run";
  NetworkGeometry geometry;
  std::vector<Sighting> sightings;  ///< all, in the order of photos and markers, with their fate
  std::vector<Vector8d>
      residuals_px;  ///< per sighting, observed minus projected; zero where there is no geometry
  std::vector<double> redundancy;       ///< per sighting, 0 to 1
  BundleLayout layout;                  ///< columns of the common parameters
  Eigen::MatrixXd common_covariance;    ///< of the common parameters, with sigma0
  std::vector<EpochCovariance> epochs;  ///< see fixed_from_moving
  std::vector<PhotoCovariance> photo_covariances;
  double sigma0 = 0;  ///< root of the variance factor: residuals over what the observations promised
  double redundancy_total = 0;
  double rms_px = 0;
  bool shape_free = false;  ///< corners were freed
  double interior_chi2 =
      0;  ///< squared distance of the interior orientation from the calibration, in its sigmas
  int interior_dof = 0;
  bool interior_loosened = false;  ///< the prior had to be widened: the camera is not as it was calibrated
  int iterations = 0;
  std::vector<ResidualSummary> photo_residuals, marker_residuals, epoch_residuals;
  /// Per photograph: the pose rests on one marker whose two planar solutions both fit.
  std::vector<char> photo_ambiguous;
};

/// Bundle adjustment of a whole campaign (Triggs et al. 2000; Förstner and Wrobel 2016, ch. 15): camera pose
/// per photograph, pose of the moving body per epoch, pose (and shape) of every marker, interior orientation.
/// Observations are whitened by their 8x8 covariances. Camera and body poses are eliminated epoch by epoch,
/// which costs time proportional to the number of photographs and gives the covariances of all poses in
/// closed form; that is why the normal equations are reduced here and not by a general solver. Bad
/// observations get a status; never throws for data.
[[nodiscard]] AdjustmentResult adjust_network(const Network& network, const AdjustmentOptions& options);

/// Covariance of (fixed_from_moving of epoch a, of epoch b).
[[nodiscard]] Matrix6d epoch_covariance(const AdjustmentResult& result, int epoch_a, int epoch_b);
/// Covariance of a photograph's camera_from_fixed; `epoch` is the one it belongs to.
[[nodiscard]] Matrix6d photo_covariance(const AdjustmentResult& result, int photo, int epoch);

}  // namespace hexcal
