#include "kinematics/newton.h"

#include <cmath>
#include <limits>
#include <utility>

#include "kinematics/screw.h"

namespace hexcal {
namespace {

// Six equations in rows of eight: six coefficients, the right side and one unused lane, so that a row is four
// 16-byte registers.
struct Equations {
  alignas(16) double row[6][8];
};

// Gaussian elimination with row pivoting; the solution is left in x and the determinant returned. A zero
// pivot stands for a singular matrix: x is then not finite.
double solve(Equations& e, double (&x)[6]) {
  double determinant = 1;
  double over_pivot[6];
  int order[6] = {0, 1, 2, 3, 4, 5};
  for (int k = 0; k < 6; ++k) {
    int best = k;
    double largest = std::abs(e.row[order[k]][k]);
    for (int r = k + 1; r < 6; ++r) {
      const double size = std::abs(e.row[order[r]][k]);
      if (size > largest) {
        largest = size;
        best = r;
      }
    }
    if (best != k) {
      std::swap(order[k], order[best]);
      determinant = -determinant;
    }
    const double* pivot = e.row[order[k]];
    determinant *= pivot[k];
    over_pivot[k] = 1 / pivot[k];
    const int first = (k + 1) & ~1;  // whole registers
    for (int r = k + 1; r < 6; ++r) {
      double* row = e.row[order[r]];
      const double factor = row[k] * over_pivot[k];
      for (int c = first; c < 8; ++c) row[c] -= factor * pivot[c];
    }
  }
  for (int k = 5; k >= 0; --k) {
    const double* row = e.row[order[k]];
    double sum = row[6];
    for (int c = k + 1; c < 6; ++c) sum -= row[c] * x[c];
    x[k] = sum * over_pivot[k];
  }
  return determinant;
}

struct Motion {
  double w, x, y, z;  // unit quaternion
  Eigen::Vector3d t;
};

Eigen::Matrix3d matrix(const Motion& m) {
  Eigen::Matrix3d r;
  const double x2 = m.x + m.x;
  const double y2 = m.y + m.y;
  const double z2 = m.z + m.z;
  const double wx = m.w * x2;
  const double wy = m.w * y2;
  const double wz = m.w * z2;
  const double xx = m.x * x2;
  const double xy = m.x * y2;
  const double xz = m.x * z2;
  const double yy = m.y * y2;
  const double yz = m.y * z2;
  const double zz = m.z * z2;
  r << 1 - (yy + zz), xy - wz, xz + wy, xy + wz, 1 - (xx + zz), yz - wx, xz - wy, yz + wx, 1 - (xx + yy);
  return r;
}

// The Cayley form of exp(dr): equal to it to second order, which Newton's method cannot tell, and without
// sines.
void update(Motion& m, const double (&delta)[6]) {
  m.t += Eigen::Vector3d(delta[0], delta[1], delta[2]);
  const double x = 0.5 * delta[3];
  const double y = 0.5 * delta[4];
  const double z = 0.5 * delta[5];
  const Motion q = m;
  m.w = q.w - x * q.x - y * q.y - z * q.z;
  m.x = q.x + x * q.w + y * q.z - z * q.y;
  m.y = q.y + y * q.w + z * q.x - x * q.z;
  m.z = q.z + z * q.w + x * q.y - y * q.x;
  const double over = 1 / std::sqrt(m.w * m.w + m.x * m.x + m.y * m.y + m.z * m.z);
  m.w *= over;
  m.x *= over;
  m.y *= over;
  m.z *= over;
}

// `evaluate(rotation, translation, equations)` fills the Jacobian and, on the right side, wanted minus actual
// length; it returns the largest residual.
template <class Evaluate>
NewtonResult iterate(const Evaluate& evaluate, double squared_unit_mm2, double rounding_mm,
                     const Rigid3& start, const NewtonOptions& options) {
  NewtonResult result;
  Motion at{start.rotation.w(), start.rotation.x(), start.rotation.y(), start.rotation.z(),
            start.translation};
  double last_mm = 0;
  for (int i = 0; i < options.max_iterations && !result.converged; ++i) {
    Equations equations;
    double delta[6];
    result.residual_mm = evaluate(matrix(at), at.t, equations);
    result.determinant = solve(equations, delta);
    result.iterations = i + 1;
    const double turn2 = delta[3] * delta[3] + delta[4] * delta[4] + delta[5] * delta[5];
    const double step_mm =
        std::sqrt(delta[0] * delta[0] + delta[1] * delta[1] + delta[2] * delta[2] + turn2 * squared_unit_mm2);
    if (!(step_mm <= std::numeric_limits<double>::max())) {
      result.singular = true;
      return result;
    }
    const double contraction = i == 0 ? 0 : step_mm / last_mm;
    if (i == 1) result.first_contraction = contraction;
    if (i > 0 && contraction > 0.5 && result.residual_mm <= rounding_mm) {
      result.converged = true;  // rounding is all that is left
      break;
    }
    if (contraction > options.largest_contraction) return result;
    update(at, delta);
    last_mm = step_mm;
    // Convergence is quadratic: the next step would be about contraction^2 times this one.
    const double next_mm = i == 0 ? step_mm : contraction * contraction * step_mm;
    result.converged = next_mm <= options.tolerance_mm || step_mm <= options.tolerance_mm;
  }
  result.B_from_P.rotation = Eigen::Quaterniond(at.w, at.x, at.y, at.z);
  result.B_from_P.translation = at.t;
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
  const auto evaluate = [&](const Eigen::Matrix3d& r, const Eigen::Vector3d& t, Equations& e) {
    const LegLanes lanes = leg_lanes(legs, r, t);
    const LegArray::Lanes residual = lengths_mm.array() - lanes.length;
    for (int i = 0; i < 6; ++i) {
      double* row = e.row[i];
      row[0] = lanes.ux[i];
      row[1] = lanes.uy[i];
      row[2] = lanes.uz[i];
      row[3] = lanes.mx[i];
      row[4] = lanes.my[i];
      row[5] = lanes.mz[i];
      row[6] = residual[i];
      row[7] = 0;
    }
    return residual.abs().maxCoeff();
  };
  return iterate(evaluate, squared_unit_mm2, rounding_level_mm(lengths_mm, start), start, options);
}

NewtonResult newton_with_screws(const PlatformGeometry& geometry, const LegVector& lengths_mm,
                                const Rigid3& start, const NewtonOptions& options) {
  double squared_unit_mm2 = 0;
  for (const Eigen::Vector3d& b : geometry.platform_joints_mm) squared_unit_mm2 += b.squaredNorm() / 6;
  const auto evaluate = [&](const Eigen::Matrix3d& r, const Eigen::Vector3d& t, Equations& e) {
    const Rigid3 pose(r, t);
    const LegVector residual = lengths_mm - actuated_lengths(geometry, pose);
    const Matrix6d j = actuated_jacobian(geometry, pose);
    for (int i = 0; i < 6; ++i) {
      for (int k = 0; k < 6; ++k) e.row[i][k] = j(i, k);
      e.row[i][6] = residual[i];
      e.row[i][7] = 0;
    }
    return residual.cwiseAbs().maxCoeff();
  };
  return iterate(evaluate, squared_unit_mm2, rounding_level_mm(lengths_mm, start), start, options);
}

}  // namespace hexcal
