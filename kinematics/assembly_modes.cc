#include "kinematics/assembly_modes.h"

#include <algorithm>
#include <cmath>

#include "kinematics/complex_platform.h"
#include "kinematics/geometry/covariance.h"
#include "kinematics/newton.h"

namespace hexcal {
namespace {

// Lengths in units of the mean leg keep all numbers near one.
ComplexPlatform target(const PlatformGeometry& geometry, const LegVector& lengths_mm, double unit_mm,
                       const ComplexPlatform& generic) {
  ComplexPlatform p;
  for (std::size_t i = 0; i < 6; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const Eigen::Vector3d a = geometry.base_joints_mm[i] / unit_mm;
    const Eigen::Vector3d b = geometry.platform_joints_mm[i] / unit_mm;
    const double length = lengths_mm[k] / unit_mm;
    p.a.col(k) = a.cast<Complex>();
    p.b.col(k) = b.cast<Complex>();
    p.constant[k] = a.squaredNorm() + b.squaredNorm() - length * length;
  }
  p.plane = generic.plane;
  return p;
}

// A rotation's quaternion is real up to a factor. `imaginary` is how far it is from that.
Rigid3 real_part(const ComplexPose& z, double unit_mm, double& imaginary) {
  Complex norm = 0;
  for (int k = 3; k < 7; ++k) norm += z[k] * z[k];
  const Eigen::Matrix<Complex, 4, 1> q = z.tail<4>() / std::sqrt(norm);
  imaginary = std::sqrt(q.imag().squaredNorm() + z.head<3>().imag().squaredNorm());
  const Eigen::Vector4d r = q.real();
  return {Eigen::Quaterniond(r[0], r[1], r[2], r[3]), z.head<3>().real() * unit_mm};
}

// Paths that came too close to another: two ends at one place.
std::vector<std::size_t> doubled(const std::vector<PathResult>& paths) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    for (std::size_t j = 0; j < paths.size(); ++j) {
      if (i == j || paths[i].end != PathEnd::reached || paths[j].end != PathEnd::reached) continue;
      if ((paths[i].pose - paths[j].pose).norm() < 1e-9 * paths[i].pose.norm()) {
        out.push_back(i);
        break;
      }
    }
  }
  return out;
}

int count(const std::vector<PathResult>& paths, PathEnd end) {
  return static_cast<int>(
      std::count_if(paths.begin(), paths.end(), [end](const PathResult& p) { return p.end == end; }));
}

// The same poses of the same platform with another unit of length, which may be complex.
GenericPlatform resized(GenericPlatform generic, const Complex& size) {
  generic.platform.a *= size;
  generic.platform.b *= size;
  generic.platform.constant *= size * size;
  for (ComplexPose& pose : generic.poses) pose.head<3>() *= size;
  return generic;
}

std::vector<PathResult> all_paths(const GenericPlatform& generic, const PlatformGeometry& geometry,
                                  const LegVector& lengths_mm, double unit_mm) {
  const Way way{generic.platform, target(geometry, lengths_mm, unit_mm, generic.platform)};
  std::vector<PathResult> paths;
  for (const ComplexPose& start : generic.poses) paths.push_back(follow(way, start, 0.2));
  for (const double contraction : {0.05, 0.01}) {
    for (const std::size_t i : doubled(paths)) paths[i] = follow(way, generic.poses[i], contraction);
  }
  return paths;
}

}  // namespace

AssemblyModes assembly_modes(const PlatformGeometry& geometry, const LegVector& lengths_mm) {
  AssemblyModes result;
  if (!lengths_mm.allFinite() || !(lengths_mm.minCoeff() > 0)) {
    result.reason = "the leg lengths are not positive numbers";
    return result;
  }
  if (geometry.screw && geometry.screw->lead_mm != 0) {
    result.reason = "a machine with a screw lead is not handled";
    return result;
  }
  const double unit_mm = lengths_mm.mean();
  std::vector<PathResult> paths;
  int fewest = 41;
  // A way may pass too near to infinity to be followed; another size of the start makes it another way.
  for (const Complex& size :
       {Complex(1, 0), std::polar(1.1, 0.7), std::polar(0.9, -1.9), std::polar(1.2, 2.6)}) {
    std::vector<PathResult> attempt =
        all_paths(resized(generic_platform(), size), geometry, lengths_mm, unit_mm);
    const int lost = 40 - static_cast<int>(attempt.size()) + count(attempt, PathEnd::lost);
    if (lost < fewest) {
      fewest = lost;
      paths = std::move(attempt);
    }
    if (fewest == 0) break;
  }
  result.paths_lost = 40 - static_cast<int>(paths.size());

  const LegArray legs(geometry);
  const RestState rest(geometry);
  for (const PathResult& path : paths) {
    if (path.end == PathEnd::infinity) ++result.paths_to_infinity;
    if (path.end == PathEnd::lost) ++result.paths_lost;
    if (path.end != PathEnd::reached) continue;
    double imaginary = 0;
    const Rigid3 start = real_part(path.pose, unit_mm, imaginary);
    // A pair of complex poses about to become real has a small imaginary part too: Newton's method in real
    // numbers tells them apart, for it stays at a real pose and leaves the other.
    const NewtonResult solve = imaginary < 1e-3 ? newton(legs, lengths_mm, start) : NewtonResult{};
    const Vector6d moved = solve.converged ? perturbation_between(start, solve.B_from_P) : Vector6d::Ones();
    const bool stays =
        moved.head<3>().norm() / unit_mm + moved.tail<3>().norm() < std::max(1e-8, 4 * imaginary);
    if (!solve.converged || !(imaginary < 1e-6) || !stays) {
      ++result.paths_to_complex;
      continue;
    }
    AssemblyMode mode;
    mode.B_from_P = solve.B_from_P;
    const InverseResult inverse_result = inverse_kinematics(geometry, rest, mode.B_from_P);
    mode.residual_mm = (inverse_result.lengths_mm - lengths_mm).cwiseAbs().maxCoeff();
    mode.sigma_min = inverse_result.singularity ? inverse_result.singularity->sigma_min : 0;
    mode.verdict = inverse_result.verdict;
    result.modes.push_back(mode);
  }
  const auto from_home = [&](const AssemblyMode& m) {
    return (m.B_from_P.translation - rest.home.translation).norm() / unit_mm +
           rotation_distance(m.B_from_P.rotation, rest.home.rotation);
  };
  std::stable_sort(result.modes.begin(), result.modes.end(),
                   [&](const AssemblyMode& l, const AssemblyMode& r) {
                     const bool l_feasible = l.verdict == PoseVerdict::reachable;
                     const bool r_feasible = r.verdict == PoseVerdict::reachable;
                     return l_feasible != r_feasible ? l_feasible : from_home(l) < from_home(r);
                   });
  return result;
}

}  // namespace hexcal
