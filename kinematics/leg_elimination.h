#pragma once

#include <Eigen/Geometry>

#include "kinematics/leg_array.h"

namespace hexcal {

/// Which leg stands in which lane.
using LegOrder = std::array<Eigen::Index, 6>;

[[nodiscard]] LegArray::Lanes in_order(const LegArray::Lanes& lanes, const LegOrder& order);
[[nodiscard]] bool is_odd(const LegOrder& order);

/// Solves the six leg equations (direction_i, moment_i) . (dt, dr) = residual_i by blocks: the legs of lanes
/// 0, 2 and 4, whose directions must span space, give dt as a function of dr, the other three then give dr.
/// Cofactors (cross products) invert both blocks with one division each, which takes a third of the time of
/// an elimination with row pivoting. Choosing the first three by `spanning_order` is the pivoting. A singular
/// matrix gives results that are not finite.
class LegElimination {
 public:
  using Lanes = LegArray::Lanes;
  using Columns = std::array<Lanes, 6>;  ///< of unknown dt x, y, z, dr x, y, z; one lane per leg

  /// False when the first three directions are so close to one plane that another order should be tried.
  // Inlined by force, as solve: called where every register counts, and the compiler finds them too large.
  [[nodiscard, gnu::always_inline]] bool factor(const Columns& columns) {
    const std::array<Eigen::Vector3d, 3> d{direction(columns, 0), direction(columns, 2),
                                           direction(columns, 4)};
    const std::array<Eigen::Vector3d, 3> m{moment(columns, 0), moment(columns, 2), moment(columns, 4)};
    first_determinant_ = invert(d[0], d[1], d[2], inverse_directions_);
    std::array<Eigen::Vector3d, 3> rest;  // what is left of the other legs' moments
    for (std::size_t i = 0; i < 3; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      first_moments_.row(row) = m[i].transpose();
      const Eigen::Vector3d f = inverse_directions_.transpose() * direction(columns, 2 * row + 1);
      factors_.row(row) = f.transpose();
      rest[i] = moment(columns, 2 * row + 1) - (f[0] * m[0] + f[1] * m[1] + f[2] * m[2]);
    }
    rest_determinant_ = invert(rest[0], rest[1], rest[2], inverse_rest_);
    return first_determinant_ * first_determinant_ >
           kFlat * kFlat * d[0].squaredNorm() * d[1].squaredNorm() * d[2].squaredNorm();
  }

  [[nodiscard, gnu::always_inline]] Vector6d solve(const Lanes& residual) const {
    const Eigen::Vector3d first(residual[0], residual[2], residual[4]);
    const Eigen::Vector3d other(residual[1], residual[3], residual[5]);
    const Eigen::Vector3d dr = inverse_rest_ * (other - factors_ * first);
    const Eigen::Vector3d dt = inverse_directions_ * (first - first_moments_ * dr);
    return {dt[0], dt[1], dt[2], dr[0], dr[1], dr[2]};
  }

  /// Of the matrix with its rows in the lanes' order; lanes 0, 2, 4, 1, 3, 5 are an odd permutation.
  [[nodiscard]] double determinant() const { return -first_determinant_ * rest_determinant_; }

  /// The order in which the first three directions span the largest volume, the others as they come.
  [[nodiscard]] static LegOrder spanning_order(const Columns& columns);

 private:
  static constexpr double kFlat = 1e-3;  // volume of three unit directions

  [[gnu::always_inline]] static Eigen::Vector3d direction(const Columns& c, Eigen::Index lane) {
    return {c[0][lane], c[1][lane], c[2][lane]};
  }
  [[gnu::always_inline]] static Eigen::Vector3d moment(const Columns& c, Eigen::Index lane) {
    return {c[3][lane], c[4][lane], c[5][lane]};
  }

  // Inverse of the matrix with these rows; returns its determinant.
  [[gnu::always_inline]] static double invert(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                              const Eigen::Vector3d& c, Eigen::Matrix3d& inverse) {
    const Eigen::Vector3d bc = b.cross(c);
    const double determinant = a.dot(bc);
    const double over = 1 / determinant;
    inverse.col(0) = over * bc;
    inverse.col(1) = over * c.cross(a);
    inverse.col(2) = over * a.cross(b);
    return determinant;
  }

  Eigen::Matrix3d inverse_directions_;  // of the first three
  Eigen::Matrix3d first_moments_;
  Eigen::Matrix3d factors_;  // the others' directions in terms of the first three
  Eigen::Matrix3d inverse_rest_;
  double first_determinant_ = 0;
  double rest_determinant_ = 0;
};

}  // namespace hexcal
