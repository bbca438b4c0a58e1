#include "kinematics/workspace.h"

#include <algorithm>
#include <cmath>
#include <thread>

#include "kinematics/geometry/input_error.h"

namespace hexcal {
namespace {

double at(double low, double high, int i, int count) {
  return count > 1 ? low + (high - low) * i / (count - 1) : low;
}

// Positions of LG at a fixed orientation: base joint i then keeps to a fixed point of the home frame.
class BoxTest {
 public:
  BoxTest(const PlatformGeometry& geometry, const BoxOptions& options)
      : geometry_(geometry), rest_(geometry), options_(options) {
    const Rigid3 at_zero = geometry.B_from_P({Eigen::Vector3d::Zero(), options.rpy_rad});
    const Eigen::Quaterniond home_from_B = geometry.B_from_UG.rotation.conjugate();
    for (std::size_t i = 0; i < 6; ++i)
      legs_[i] = home_from_B * (at_zero * geometry.platform_joints_mm[i] - geometry.base_joints_mm[i]);
  }

  [[nodiscard]] bool valid(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper) const {
    // With screws the reading differs from the joint distance by up to half a lead.
    const double slack =
        options_.margins.stroke_mm + (geometry_.screw ? std::abs(geometry_.screw->lead_mm) / 2 : 0);
    for (std::size_t i = 0; i < 6; ++i) {
      const Eigen::Vector3d low = legs_[i] + lower;
      const Eigen::Vector3d high = legs_[i] + upper;
      const double nearest = low.cwiseMax(Eigen::Vector3d::Zero()).cwiseMax(-high).norm();
      const double farthest = low.cwiseAbs().cwiseMax(high.cwiseAbs()).norm();
      if (nearest < geometry_.actuators[i].min_mm + slack || farthest > geometry_.actuators[i].max_mm - slack)
        return false;
    }
    const int n = options_.grid - 1;
    for (int i = 0; i <= n; ++i) {
      for (int j = 0; j <= n; ++j) {
        for (int k = 0; k <= n; ++k) {
          const Eigen::Vector3d part(static_cast<double>(i) / n, static_cast<double>(j) / n,
                                     static_cast<double>(k) / n);
          const Eigen::Vector3d position = lower + part.cwiseProduct(upper - lower);
          if (!is_valid(geometry_, rest_, {position, options_.rpy_rad}, options_.margins)) return false;
        }
      }
    }
    return true;
  }

 private:
  const PlatformGeometry& geometry_;
  RestState rest_;
  BoxOptions options_;
  std::array<Eigen::Vector3d, 6>
      legs_;  // from base joint to platform joint at position zero, in the home frame
};

}  // namespace

void SliceOptions::validate() const {
  if (axis_u < 0 || axis_u > 5) throw InputError("SliceOptions.axis_u must lie in 0..5");
  if (axis_v < 0 || axis_v > 5 || axis_v == axis_u)
    throw InputError("SliceOptions.axis_v must lie in 0..5 and differ from axis_u");
  if (!(u_high >= u_low) || !(v_high >= v_low) || !std::isfinite(u_high - u_low) ||
      !std::isfinite(v_high - v_low))
    throw InputError("SliceOptions: a range must be finite and not reversed");
  if (u_count < 1 || v_count < 1) throw InputError("SliceOptions.u_count and v_count must be at least 1");
  if (threads < 1 || threads > 256) throw InputError("SliceOptions.threads must be 1 to 256");
}

SliceCell judge_pose(const PlatformGeometry& geometry, const RestState& rest, const Pose& pose) {
  const InverseResult r = inverse_kinematics(geometry, rest, geometry.B_from_P(pose));
  SliceCell cell;
  cell.pose = pose;
  cell.verdict = r.verdict;
  cell.stroke_margin_mm = r.stroke_margin_mm;
  cell.joint_margin_rad = r.joint_margin_rad;
  cell.clearance_mm = r.clearance_mm;
  if (r.singularity) {
    cell.singular_mm = r.singularity->distance_mm;
    cell.sigma_min = r.singularity->sigma_min;
  }
  return cell;
}

std::vector<SliceCell> workspace_slice(const PlatformGeometry& geometry, const SliceOptions& options) {
  options.validate();
  const RestState rest(geometry);
  std::vector<SliceCell> cells(static_cast<std::size_t>(options.u_count) *
                               static_cast<std::size_t>(options.v_count));
  const auto rows = [&](int first) {
    for (int j = first; j < options.v_count; j += options.threads) {
      for (int i = 0; i < options.u_count; ++i) {
        Vector6d v = options.centre.vector();
        v[options.axis_u] = at(options.u_low, options.u_high, i, options.u_count);
        v[options.axis_v] = at(options.v_low, options.v_high, j, options.v_count);
        cells[static_cast<std::size_t>(j) * static_cast<std::size_t>(options.u_count) +
              static_cast<std::size_t>(i)] = judge_pose(geometry, rest, Pose::from_vector(v));
      }
    }
  };
  std::vector<std::thread> others;
  for (int t = 1; t < options.threads; ++t) others.emplace_back(rows, t);
  rows(0);
  for (std::thread& other : others) other.join();
  return cells;
}

void BoxOptions::validate() const {
  margins.validate();
  if (grid < 2) throw InputError("BoxOptions.grid must be at least 2");
  if (!rpy_rad.allFinite()) throw InputError("BoxOptions.rpy_rad is not finite");
}

ConstantOrientationBox largest_box(const PlatformGeometry& geometry, const BoxOptions& options) {
  options.validate();
  const BoxTest test(geometry, options);
  ConstantOrientationBox best;
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  if (!test.valid(zero, zero)) return best;
  best.found = true;
  double longest = 0;
  for (const Actuator& a : geometry.actuators) longest = std::max(longest, a.max_mm);
  using Faces = Vector6d;  // lower (negative) and upper, as distances from home
  const auto lower = [](const Faces& f) { return Eigen::Vector3d(-f.head<3>()); };
  const auto upper = [](const Faces& f) { return Eigen::Vector3d(f.tail<3>()); };
  const auto volume = [](const Faces& f) { return (f.head<3>() + f.tail<3>()).prod(); };
  double largest = 0;
  for (const double flat : {1.0, 0.5, 2.0}) {
    // Start from the largest box of one shape, then trade the faces against each other.
    const Eigen::Vector3d shape(1, 1, flat);
    double good = 0;
    double bad = longest;
    for (int i = 0; i < 30; ++i) {
      const double half = 0.5 * (good + bad);
      (test.valid(-half * shape, half * shape) ? good : bad) = half;
    }
    Faces faces;
    faces << good * shape, good * shape;
    for (double step = 0.5 * std::max(good, 0.02 * longest); step > 1e-4 * longest; step *= 0.5) {
      for (bool better = true; better;) {
        better = false;
        const auto attempt = [&](const Faces& next) {
          if (next.minCoeff() < 0 || volume(next) <= volume(faces) * (1 + 1e-9)) return;
          if (!test.valid(lower(next), upper(next))) return;
          faces = next;
          better = true;
        };
        for (Eigen::Index grow = 0; grow < 6; ++grow) {
          attempt(faces + step * Faces::Unit(grow));
          for (Eigen::Index shrink = 0; shrink < 6; ++shrink) {
            if (shrink != grow) attempt(faces + step * (Faces::Unit(grow) - 0.5 * Faces::Unit(shrink)));
          }
        }
      }
    }
    if (volume(faces) > largest) {
      largest = volume(faces);
      best.lower_mm = lower(faces);
      best.upper_mm = upper(faces);
    }
  }
  return best;
}

}  // namespace hexcal
