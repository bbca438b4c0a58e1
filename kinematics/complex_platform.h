#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>
#include <vector>

namespace hexcal {

using Complex = std::complex<double>;

/// Stewart platforms with complex numbers: the system that assembly_modes.cc follows.
///
/// Unknowns z = (t, q): translation and quaternion (w, x, y, z). With Q = q . q and R(q) = Q times the
/// rotation,
///   f_i = (t . t + |a|^2 + |b|^2 - L^2) Q - 2 Q t . a + 2 (t - a) . R(q) b = 0,  i = 1..6,
/// and q lies on a plane that fixes its free factor.
using ComplexPose = Eigen::Matrix<Complex, 7, 1>;

struct ComplexPlatform {
  Eigen::Matrix<Complex, 3, 6> a;
  Eigen::Matrix<Complex, 3, 6> b;
  Eigen::Matrix<Complex, 6, 1> constant;  ///< |a|^2 + |b|^2 - L^2
  Eigen::Matrix<Complex, 4, 1> plane;     ///< plane . q = 1
};

/// A way through the parameters: (1 - s) from + s to. The straight way from a generic platform misses, with
/// probability one, every platform with coinciding poses before it ends.
struct Way {
  ComplexPlatform from;
  ComplexPlatform to;
};

enum class PathEnd { reached, infinity, lost };

struct PathResult {
  PathEnd end = PathEnd::lost;
  ComplexPose pose;
};

/// Follows one pose along a way: Runge-Kutta of order four, Newton as corrector, and a step length that keeps
/// the corrector's contraction below `largest_contraction`.
[[nodiscard]] PathResult follow(const Way& way, const ComplexPose& start, double largest_contraction);

/// A generic platform and its 40 poses.
struct GenericPlatform {
  ComplexPlatform platform;
  std::vector<ComplexPose> poses;
};

/// Found by monodromy: one pose is invented, the platform made to fit it, and loops through random platforms
/// permute the poses until all 40 are known. Always the same one.
[[nodiscard]] const GenericPlatform& generic_platform();

}  // namespace hexcal
