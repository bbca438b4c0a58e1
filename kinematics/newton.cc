#include "kinematics/newton.h"

#include <array>
#include <cmath>
#include <limits>

#include "kinematics/leg_elimination.h"
#include "kinematics/screw.h"

namespace hexcal {
namespace {

using Lanes = LegArray::Lanes;

// A pose as Newton's method moves it. The quaternion is not kept at unit length, only how to make it one.
class MovingPose {
 public:
  explicit MovingPose(const Rigid3& start)
      : w_(start.rotation.w()),
        x_(start.rotation.x()),
        y_(start.rotation.y()),
        z_(start.rotation.z()),
        scale_(2 / start.rotation.squaredNorm()),
        t_(start.translation) {}

  [[nodiscard]] Eigen::Matrix3d rotation() const {
    const double x2 = scale_ * x_;
    const double y2 = scale_ * y_;
    const double z2 = scale_ * z_;
    const double wx = w_ * x2;
    const double wy = w_ * y2;
    const double wz = w_ * z2;
    const double xx = x_ * x2;
    const double xy = x_ * y2;
    const double xz = x_ * z2;
    const double yy = y_ * y2;
    const double yz = y_ * z2;
    const double zz = z_ * z2;
    Eigen::Matrix3d r;
    r << 1 - (yy + zz), xy - wz, xz + wy, xy + wz, 1 - (xx + zz), yz - wx, xz - wy, yz + wx, 1 - (xx + yy);
    return r;
  }
  [[nodiscard]] const Eigen::Vector3d& translation() const { return t_; }
  [[nodiscard]] Rigid3 rigid() const { return {Eigen::Quaterniond(w_, x_, y_, z_), t_}; }

  // The Cayley form of exp(dr): equal to it to second order, which Newton's method cannot tell, and without
  // sines. The quaternion (1, dr / 2) lengthens the product by a known factor, so that no norm is taken.
  void move(const Vector6d& delta) {
    t_ += delta.head<3>();
    const double x = 0.5 * delta[3];
    const double y = 0.5 * delta[4];
    const double z = 0.5 * delta[5];
    const double w0 = w_;
    const double x0 = x_;
    const double y0 = y_;
    const double z0 = z_;
    scale_ /= 1 + (x * x + y * y + z * z);
    w_ = w0 - x * x0 - y * y0 - z * z0;
    x_ = (x0 + x * w0) + (y * z0 - z * y0);
    y_ = (y0 + y * w0) + (z * x0 - x * z0);
    z_ = (z0 + z * w0) + (x * y0 - y * x0);
  }

 private:
  double w_, x_, y_, z_;
  double scale_;  // 2 / squared length of the quaternion
  Eigen::Vector3d t_;
};

// The equations (length^2 - |R b + t - a|^2) / 2 = 0: their roots are those of length - |R b + t - a|, their
// gradients leg_jacobian's rows times the lengths, and they need neither roots nor quotients.
class SquaredLegs {
 public:
  SquaredLegs(const LegArray& legs, const LegVector& lengths_mm)
      : legs_(&legs), length_(lengths_mm.array()) {}

  [[nodiscard]] Lanes residual(const MovingPose& pose) const {
    const Arms arm = arms(pose.rotation());
    const Eigen::Vector3d& t = pose.translation();
    return residual(arm.x + (t.x() - legs_->ax), arm.y + (t.y() - legs_->ay), arm.z + (t.z() - legs_->az));
  }
  [[nodiscard]] Lanes linearise(const MovingPose& pose, std::array<Lanes, 6>& columns) const {
    const Arms arm = arms(pose.rotation());
    const Eigen::Vector3d& t = pose.translation();
    columns[0] = arm.x + (t.x() - legs_->ax);
    columns[1] = arm.y + (t.y() - legs_->ay);
    columns[2] = arm.z + (t.z() - legs_->az);
    columns[3] = arm.y * columns[2] - arm.z * columns[1];
    columns[4] = arm.z * columns[0] - arm.x * columns[2];
    columns[5] = arm.x * columns[1] - arm.y * columns[0];
    return residual(columns[0], columns[1], columns[2]);
  }
  [[nodiscard]] double largest_mm(const Lanes& residual) const {
    return (residual / length_).abs().maxCoeff();
  }
  void reorder(const LegOrder& order) {
    const auto put_in_order = [&order](Lanes& lanes) { lanes = in_order(lanes, order); };
    reordered_ = *legs_;
    for (Lanes* lanes : {&reordered_.ax, &reordered_.ay, &reordered_.az, &reordered_.bx, &reordered_.by,
                         &reordered_.bz, &length_})
      put_in_order(*lanes);
    legs_ = &reordered_;
  }

 private:
  struct Arms {
    Lanes x, y, z;  // R b
  };
  [[nodiscard]] Arms arms(const Eigen::Matrix3d& r) const {
    const LegArray& l = *legs_;
    return {r(0, 0) * l.bx + r(0, 1) * l.by + r(0, 2) * l.bz,
            r(1, 0) * l.bx + r(1, 1) * l.by + r(1, 2) * l.bz,
            r(2, 0) * l.bx + r(2, 1) * l.by + r(2, 2) * l.bz};
  }
  [[nodiscard]] Lanes residual(const Lanes& dx, const Lanes& dy, const Lanes& dz) const {
    // The difference of squares keeps the digits where legs stand steep.
    return 0.5 * ((length_ - dz) * (length_ + dz) - (dx * dx + dy * dy));
  }

  const LegArray* legs_;
  Lanes length_;
  LegArray reordered_;
};

// The equations length - actuated length = 0.
class ScrewLegs {
 public:
  ScrewLegs(const PlatformGeometry& geometry, const LegVector& lengths_mm)
      : geometry_(geometry), length_(lengths_mm.array()) {}

  [[nodiscard]] Lanes residual(const MovingPose& pose) const {
    return in_order(length_ - actuated_lengths(geometry_, pose.rigid()).array(), order_);
  }
  [[nodiscard]] Lanes linearise(const MovingPose& pose, std::array<Lanes, 6>& columns) const {
    const Matrix6d j = actuated_jacobian(geometry_, pose.rigid());
    for (std::size_t k = 0; k < 6; ++k)
      columns[k] = in_order(j.col(static_cast<Eigen::Index>(k)).array(), order_);
    return residual(pose);
  }
  [[nodiscard]] static double largest_mm(const Lanes& residual) { return residual.abs().maxCoeff(); }
  void reorder(const LegOrder& order) {
    const LegOrder before = order_;
    for (std::size_t lane = 0; lane < 6; ++lane) order_[lane] = before[static_cast<std::size_t>(order[lane])];
  }

 private:
  const PlatformGeometry& geometry_;
  Lanes length_;
  LegOrder order_{0, 1, 2, 3, 4, 5};
};

// Newton's method in which each matrix serves several corrections: the one at its own pose (ordinary) and
// then, while they shrink quickly, those at the poses reached (simplified). Two corrections by one matrix
// converge with order three (Potra & Ptak 1984) and cost little more than one.
template <class Legs>
NewtonResult iterate(Legs legs, double squared_unit_mm2, double rounding_mm, const Rigid3& start,
                     const NewtonOptions& options) {
  // A correction that shrinks less than this is no longer simplified, and at the level of rounding the last.
  constexpr double kSlow2 = 0.25 * 0.25;
  const double tolerance2 = options.tolerance_mm * options.tolerance_mm;
  const double largest2 = options.largest_contraction * options.largest_contraction;
  NewtonResult result;
  MovingPose at(start);
  LegElimination matrix;
  double last2 = std::numeric_limits<double>::infinity();  // squared size of the last correction
  int corrections = 0;
  bool odd_order = false;
  while (result.iterations < options.max_iterations && !result.converged) {
    std::array<Lanes, 6> columns;
    Lanes residual = legs.linearise(at, columns);
    if (!matrix.factor(columns)) {
      const LegOrder order = LegElimination::spanning_order(columns);
      legs.reorder(order);
      odd_order ^= is_odd(order);
      residual = legs.linearise(at, columns);
      (void)matrix.factor(columns);
    }
    ++result.iterations;
    for (bool ordinary = true;; ordinary = false) {
      const Vector6d delta = matrix.solve(residual);
      const double step2 = delta.head<3>().squaredNorm() + squared_unit_mm2 * delta.tail<3>().squaredNorm();
      if (!(step2 <= std::numeric_limits<double>::max())) {
        result.singular = true;
        return result;
      }
      const double contraction2 = step2 / last2;
      if (++corrections == 2) result.first_contraction = std::sqrt(contraction2);
      if (contraction2 > kSlow2 && legs.largest_mm(residual) <= rounding_mm) {
        result.converged = true;
        break;
      }
      if (contraction2 > largest2) return result;
      if (!ordinary && contraction2 > kSlow2) break;
      at.move(delta);
      last2 = step2;
      if (step2 <= tolerance2) {
        result.converged = true;
        break;
      }
      if (!ordinary) {
        // The rate of simplified corrections is at most about twice the first contraction.
        const double rate2 = 4 * contraction2;
        result.converged = rate2 * step2 <= tolerance2;
        if (result.converged || rate2 * rate2 * step2 > tolerance2) break;
      }
      residual = legs.residual(at);
    }
  }
  result.determinant = odd_order ? -matrix.determinant() : matrix.determinant();
  result.B_from_P = at.rigid();
  return result;
}

// Residuals below this many mm are rounding.
double rounding_level_mm(const LegVector& lengths_mm, const Rigid3& start) {
  return 64 * std::numeric_limits<double>::epsilon() *
         (lengths_mm.cwiseAbs().maxCoeff() + start.translation.cwiseAbs().maxCoeff());
}

}  // namespace

NewtonResult newton(const LegArray& legs, const LegVector& lengths_mm, const Rigid3& start,
                    const NewtonOptions& options) {
  const double squared_unit_mm2 = (legs.bx * legs.bx + legs.by * legs.by + legs.bz * legs.bz).sum() / 6;
  return iterate(SquaredLegs(legs, lengths_mm), squared_unit_mm2, rounding_level_mm(lengths_mm, start), start,
                 options);
}

NewtonResult newton_with_screws(const PlatformGeometry& geometry, const LegVector& lengths_mm,
                                const Rigid3& start, const NewtonOptions& options) {
  double squared_unit_mm2 = 0;
  for (const Eigen::Vector3d& b : geometry.platform_joints_mm) squared_unit_mm2 += b.squaredNorm() / 6;
  return iterate(ScrewLegs(geometry, lengths_mm), squared_unit_mm2, rounding_level_mm(lengths_mm, start),
                 start, options);
}

}  // namespace hexcal
