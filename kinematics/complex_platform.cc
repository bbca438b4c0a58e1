#include "kinematics/complex_platform.h"

#include <Eigen/LU>
#include <cmath>
#include <random>

namespace hexcal {
namespace {

using Matrix7 = Eigen::Matrix<Complex, 7, 7>;
using Vector3 = Eigen::Matrix<Complex, 3, 1>;
using Matrix3 = Eigen::Matrix<Complex, 3, 3>;

constexpr std::size_t kPoses = 40;

// Products without conjugation: these are polynomials, not norms.
Complex dot(const Vector3& a, const Vector3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Matrix3 scaled_rotation(const Complex& w, const Complex& x, const Complex& y, const Complex& z) {
  Matrix3 r;
  r << w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y),  //
      2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x),   //
      2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z;
  return r;
}

// d(R(q) b)/dq, columns w, x, y, z. R(q) b = (w^2 - v.v) b + 2 (v.b) v + 2 w v x b.
Eigen::Matrix<Complex, 3, 4> rotation_derivative(const ComplexPose& z, const Vector3& b) {
  const Complex w = z[3];
  const Vector3 v = z.tail<3>();
  const Vector3 vxb(v[1] * b[2] - v[2] * b[1], v[2] * b[0] - v[0] * b[2], v[0] * b[1] - v[1] * b[0]);
  Eigen::Matrix<Complex, 3, 4> d;
  d.col(0) = 2.0 * (w * b + vxb);
  const Complex vb = dot(v, b);
  for (int k = 0; k < 3; ++k) {
    Vector3 ek = Vector3::Zero();
    ek[k] = 1.0;
    const Vector3 exb(ek[1] * b[2] - ek[2] * b[1], ek[2] * b[0] - ek[0] * b[2], ek[0] * b[1] - ek[1] * b[0]);
    d.col(1 + k) = 2.0 * (-v[k] * b + b[k] * v + vb * ek + w * exb);
  }
  return d;
}

struct System {
  ComplexPose value;
  ComplexPose by_s;  // along the way
  Matrix7 jacobian;
};

void evaluate(const Way& way, double s, const ComplexPose& z, System& system) {
  const Vector3 t = z.head<3>();
  const Complex tt = dot(t, t);
  Complex norm = 0;
  for (int k = 3; k < 7; ++k) norm += z[k] * z[k];
  const Matrix3 r = scaled_rotation(z[3], z[4], z[5], z[6]);
  for (int i = 0; i < 6; ++i) {
    const Vector3 da = way.to.a.col(i) - way.from.a.col(i);
    const Vector3 db = way.to.b.col(i) - way.from.b.col(i);
    const Complex dc = way.to.constant[i] - way.from.constant[i];
    const Vector3 a = way.from.a.col(i) + s * da;
    const Vector3 b = way.from.b.col(i) + s * db;
    const Complex c = way.from.constant[i] + s * dc;
    const Vector3 rb = r * b;
    const Complex ta = dot(t, a);
    const Vector3 t_a = t - a;
    system.value[i] = (tt + c - 2.0 * ta) * norm + 2.0 * dot(t_a, rb);
    system.by_s[i] = (dc - 2.0 * dot(t, da)) * norm + 2.0 * (dot(t_a, r * db) - dot(da, rb));
    for (int k = 0; k < 3; ++k) system.jacobian(i, k) = 2.0 * ((t[k] - a[k]) * norm + rb[k]);
    const Eigen::Matrix<Complex, 3, 4> drb = rotation_derivative(z, b);
    for (int k = 0; k < 4; ++k)
      system.jacobian(i, 3 + k) = 2.0 * ((tt + c - 2.0 * ta) * z[3 + k] + dot(t_a, drb.col(k)));
  }
  Complex on_plane = -1.0;
  Complex plane_by_s = 0;
  for (int k = 0; k < 4; ++k) {
    const Complex dp = way.to.plane[k] - way.from.plane[k];
    const Complex p = way.from.plane[k] + s * dp;
    on_plane += p * z[3 + k];
    plane_by_s += dp * z[3 + k];
    system.jacobian(6, 3 + k) = p;
  }
  for (int k = 0; k < 3; ++k) system.jacobian(6, k) = 0;
  system.value[6] = on_plane;
  system.by_s[6] = plane_by_s;
}

ComplexPose tangent(const Way& way, double s, const ComplexPose& z, System& system) {
  evaluate(way, s, z, system);
  return -system.jacobian.partialPivLu().solve(system.by_s);
}

// Newton's method at s; true if every step is shorter than the last by the wanted factor and the last is at
// rounding.
bool correct(const Way& way, double s, double largest_contraction, ComplexPose& z, System& system) {
  double last = 0;
  for (int i = 0; i < 6; ++i) {
    evaluate(way, s, z, system);
    const ComplexPose step = system.jacobian.partialPivLu().solve(system.value);
    const double size = step.norm() / z.norm();
    if (!(size < 0.1)) return false;
    if (i > 0 && size > 1e-13 && size > largest_contraction * last)
      return size < 1e-8;  // rounding is all that is left
    z -= step;
    if (size < 1e-13 || (i > 0 && size * size / last < 1e-14)) return true;
    last = size;
  }
  return false;
}

// Uniform in a square from the generator's bits, alike in every standard library.
Complex random_complex(std::mt19937_64& random) {
  const double re = static_cast<double>(random() >> 11) * 0x1p-52 - 1;
  const double im = static_cast<double>(random() >> 11) * 0x1p-52 - 1;
  return {re, im};
}

ComplexPlatform random_platform(std::mt19937_64& random) {
  ComplexPlatform p;
  for (Complex& v : p.a.reshaped()) v = random_complex(random);
  for (Complex& v : p.b.reshaped()) v = random_complex(random);
  for (Complex& v : p.constant) v = random_complex(random);
  for (Complex& v : p.plane) v = random_complex(random);
  return p;
}

GenericPlatform find_generic_platform() {
  std::mt19937_64 random(20240501);
  GenericPlatform generic;
  generic.platform = random_platform(random);
  ComplexPose z;
  for (Complex& v : z) v = random_complex(random);
  // Put the invented quaternion on the plane and let the constants make the pose fit.
  Complex on_plane = 0;
  for (int k = 0; k < 4; ++k) on_plane += generic.platform.plane[k] * z[3 + k];
  for (int k = 0; k < 4; ++k) z[3 + k] /= on_plane;
  System system;
  evaluate({generic.platform, generic.platform}, 0, z, system);
  Complex norm = 0;
  for (int k = 3; k < 7; ++k) norm += z[k] * z[k];
  for (int i = 0; i < 6; ++i) generic.platform.constant[i] -= system.value[i] / norm;
  generic.poses.push_back(z);
  // A triangle of ways through two other platforms brings each pose back as one of the forty.
  for (int loop = 0; loop < 60 && generic.poses.size() < kPoses; ++loop) {
    const ComplexPlatform first = random_platform(random);
    const ComplexPlatform second = random_platform(random);
    const std::size_t known = generic.poses.size();
    for (std::size_t n = 0; n < known && generic.poses.size() < kPoses; ++n) {
      PathResult path = follow({generic.platform, first}, generic.poses[n], 0.2);
      if (path.end == PathEnd::reached) path = follow({first, second}, path.pose, 0.2);
      if (path.end == PathEnd::reached) path = follow({second, generic.platform}, path.pose, 0.2);
      if (path.end != PathEnd::reached) continue;
      bool is_new = true;
      for (const ComplexPose& pose : generic.poses)
        is_new = is_new && (pose - path.pose).norm() > 1e-6 * path.pose.norm();
      if (is_new) generic.poses.push_back(path.pose);
    }
  }
  return generic;
}

}  // namespace

PathResult follow(const Way& way, const ComplexPose& start, double largest_contraction) {
  constexpr double kFarAway = 1e7;
  constexpr double kSmallestStep = 1e-12;
  PathResult result;
  result.pose = start;
  System system;
  double s = 0;
  double step = 0.02;
  int good = 0;
  for (int n = 0; n < 20000; ++n) {
    const double h = std::min(step, 1 - s);
    const ComplexPose k1 = tangent(way, s, result.pose, system);
    const ComplexPose k2 = tangent(way, s + h / 2, result.pose + h / 2 * k1, system);
    const ComplexPose k3 = tangent(way, s + h / 2, result.pose + h / 2 * k2, system);
    const ComplexPose k4 = tangent(way, s + h, result.pose + h * k3, system);
    ComplexPose z = result.pose + h / 6 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    // The predictor must be near already, or the corrector might find another path.
    const ComplexPose predicted = z;
    const double next = h < step ? 1 : s + h;
    if (z.allFinite() && correct(way, next, largest_contraction, z, system) &&
        (z - predicted).norm() < 1e-4 * z.norm()) {
      result.pose = z;
      s = next;
      if (s >= 1) {
        result.end = PathEnd::reached;
        return result;
      }
      if (++good >= 3) {
        step = std::min(2 * step, 0.2);
        good = 0;
      }
      if (z.norm() > kFarAway) {
        result.end = PathEnd::infinity;
        return result;
      }
      continue;
    }
    good = 0;
    step = h / 2;
    if (step < kSmallestStep) break;
  }
  // Near the end of the way and far out: on its way to infinity, where the target has no pose. (A real pose
  // is never farther out than the legs are long, which is the unit.)
  if (1 - s < 0.05 && result.pose.norm() > 1e3) result.end = PathEnd::infinity;
  return result;
}

const GenericPlatform& generic_platform() {
  static const GenericPlatform generic = find_generic_platform();
  return generic;
}

}  // namespace hexcal
