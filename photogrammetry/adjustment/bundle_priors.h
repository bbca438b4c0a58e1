#pragma once

#include <vector>

#include "photogrammetry/adjustment/bundle_layout.h"

namespace hexcal {

struct BundleSettings {
  double data_variance = 1;                ///< factor on all observation covariances
  double size_sigma = 0;                   ///< priors of the kinds of shapes: of each square's own size,
  double squareness_sigma_mm = 0;          ///< of the other shapes in its plane, on a square as drawn,
  double flatness_sigma_mm = 0;            ///< and out of it
  double print_scale_sigma = 0;            ///< of the print scale, relative; 0: none
  double length_inflation = 1;             ///< factor on the sigmas of the known lengths
  std::vector<double> interior_inflation;  ///< per camera: factor on the calibration's sigmas
  double converged = 1e-9;                 ///< decrease of the sum of squares that is no longer worth a step
  bool interior_moves = true;              ///< false: kept, but its uncertainty goes into the covariances
  /// false: all common parameters are known from elsewhere, with a covariance; only stations and poses are
  /// estimated, and BundleSystem::normal stays empty.
  bool common_moves = true;

  /// Sigma of a shape parameter: relative, and the same whatever the print scale comes out as.
  [[nodiscard]] double shape_sigma(const ShapeParameter& shape) const;
};

/// Adds the priors and the known lengths to normal equations of the common parameters.
void add_priors(const Network& network, const NetworkGeometry& geometry, const BundleLayout& layout,
                const BundleSettings& settings, Eigen::MatrixXd& normal, Eigen::VectorXd& right);

/// Sum of squares of the priors and known lengths.
[[nodiscard]] double prior_cost(const Network& network, const NetworkGeometry& geometry,
                                const BundleLayout& layout, const BundleSettings& settings);

/// The features at both ends of some known length are in the network.
[[nodiscard]] bool has_known_length(const Network& network, const NetworkGeometry& geometry);

/// Sum of squares of the known lengths' normalised misfits, before any inflation, and by `covariance` of the
/// common parameters how many of them the others check.
struct LengthCheck {
  double squares = 0, redundancy = 0;
};
[[nodiscard]] LengthCheck check_lengths(const Network& network, const NetworkGeometry& geometry,
                                        const BundleLayout& layout, const BundleSettings& settings,
                                        const Eigen::MatrixXd& covariance);

}  // namespace hexcal
