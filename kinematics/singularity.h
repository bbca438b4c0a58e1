#pragma once

#include "kinematics/platform.h"

namespace hexcal {

struct SingularityOptions {
  double characteristic_length_mm = 0;  ///< 0: characteristic_length_mm(geometry)
  double near_mm = 5;  ///< nearer to a singular pose than this (and than near_deg) is near-singular
  double near_deg = 2;
  double near_gain = 5;  ///< so is a pose that amplifies leg errors this many times more than home

  /// Throws InputError naming the field.
  void validate() const;
};

/// How far a pose is from a singular one. All numbers but the determinant's sign belong to the force Jacobian
/// (the transpose of leg_jacobian) taken at the centroid of the platform joints and with rotations in
/// characteristic lengths, so that it has no unit and does not depend on where the frame P sits.
struct SingularityMeasures {
  double characteristic_length_mm = 0;
  double determinant = 0;
  double condition = 0;  ///< largest over smallest singular value
  double sigma_min = 0;
  double worst_gain_mm =
      0;  ///< platform motion in mm (at the centroid) for leg errors of 1 mm (root sum square)
  double worst_gain_deg = 0;  ///< and in deg, in the weakest direction
  double distance_mm = 0;     ///< translation after which sigma_min would vanish, to first order
  double distance_deg = 0;    ///< rotation after which it would
  Vector6d weakest_motion = Vector6d::Zero();  ///< unit (mm, rad x length): what the legs hardly resist
  bool same_side_as_home = true;               ///< the determinant has the sign it has at home
  bool near_singular = false;
};

/// What poses are compared with: their home.
struct HomeSingularity {
  HomeSingularity(const PlatformGeometry& geometry, double characteristic_length_mm);

  double characteristic_length_mm = 0;
  double determinant = 0;
  double sigma_min = 0;
};

[[nodiscard]] SingularityMeasures singularity_measures(const PlatformGeometry& geometry,
                                                       const Rigid3& B_from_P,
                                                       const SingularityOptions& options = {});

/// The same with what does not depend on the pose worked out before; `home` must belong to the options'
/// length.
[[nodiscard]] SingularityMeasures singularity_measures(const PlatformGeometry& geometry,
                                                       const HomeSingularity& home, const Rigid3& B_from_P,
                                                       const SingularityOptions& options = {});

/// What these measures are at least, without singular values, and the determinant itself: a tenth of the time
/// of the measures, and enough to see that a pose is far from singular. All but the determinant are zero
/// where nothing is known.
struct SingularityBounds {
  double determinant = 0;
  double sigma_min = 0;  ///< 1 / Frobenius norm of the inverse
  double distance_mm = 0;
  double distance_deg = 0;

  /// The pose cannot be near_singular by these options.
  [[nodiscard]] bool clear_of(const SingularityOptions& options, const HomeSingularity& home) const {
    return distance_mm >= options.near_mm && distance_deg >= options.near_deg &&
           sigma_min * options.near_gain >= home.sigma_min;
  }
};

[[nodiscard]] SingularityBounds singularity_bounds(const PlatformGeometry& geometry, const Rigid3& B_from_P,
                                                   double characteristic_length_mm);

/// leg_jacobian at the centroid of the platform joints, rotations divided by the length: no unit.
[[nodiscard]] Matrix6d scaled_jacobian(const PlatformGeometry& geometry, const Rigid3& B_from_P,
                                       double characteristic_length_mm);

}  // namespace hexcal
