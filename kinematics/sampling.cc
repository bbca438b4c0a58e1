#include "kinematics/sampling.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "kinematics/geometry/input_error.h"

namespace hexcal {
namespace {

// A fixed mapping from the generator's bits, so that every standard library gives the same poses.
double unit_interval(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

// Radical inverse of n (van der Corput).
double radical_inverse(std::uint64_t n, std::uint64_t base) {
  double result = 0;
  double digit = 1;
  for (; n > 0; n /= base) {
    digit /= static_cast<double>(base);
    result += digit * static_cast<double>(n % base);
  }
  return result;
}

Vector6d inside(const PoseBox& box, const Vector6d& unit) {
  return box.lower + unit.cwiseProduct(box.upper - box.lower);
}

constexpr std::array<std::uint64_t, 6> kHaltonBases{2, 3, 5, 7, 11, 13};

SampleResult sample_box(const PlatformGeometry& geometry, const RestState& rest, const SampleOptions& options,
                        const PoseBox& box) {
  SampleResult result;
  std::mt19937_64 random(options.seed);
  Vector6d shift;
  for (double& s : shift) s = unit_interval(random);
  const std::size_t tries = options.largest_tries > 0 ? options.largest_tries : 10000 + 2000 * options.count;
  while (result.poses.size() < options.count && result.tries < tries) {
    ++result.tries;
    Vector6d unit;
    for (Eigen::Index k = 0; k < 6; ++k) {
      if (options.kind == SampleKind::uniform) {
        unit[k] = unit_interval(random);
      } else {
        const double moved =
            radical_inverse(result.tries, kHaltonBases[static_cast<std::size_t>(k)]) + shift[k];
        unit[k] = moved - std::floor(moved);
      }
    }
    const Pose pose = Pose::from_vector(inside(box, unit));
    if (is_valid(geometry, rest, pose, options.margins)) result.poses.push_back(pose);
  }
  return result;
}

// Farthest that any way is followed: longer than every leg, or half a turn.
double farthest(const PlatformGeometry& geometry, const Vector6d& direction) {
  double longest = 0;
  for (const Actuator& a : geometry.actuators) longest = std::max(longest, a.max_mm);
  const double move = direction.head<3>().norm();
  const double turn = direction.tail<3>().norm();
  const double by_move = move > 0 ? 2 * longest / move : 1e300;
  const double by_turn = turn > 0 ? 85 * kRadPerDeg / turn : 1e300;
  return std::min(by_move, by_turn);
}

PoseBox widened(PoseBox box, double part) {
  const Vector6d rim = part * (box.upper - box.lower);
  const Vector6d turns = (Vector6d() << 0, 0, 0, 180, 85, 180).finished() * kRadPerDeg;
  box.lower -= rim;
  box.upper += rim;
  for (Eigen::Index k = 3; k < 6; ++k) {
    box.lower[k] = std::max(box.lower[k], -turns[k]);
    box.upper[k] = std::min(box.upper[k], turns[k]);
  }
  return box;
}

// The pose with the largest stroke margin that a search along the axes finds from home.
Pose most_central(const PlatformGeometry& geometry, const RestState& rest) {
  const auto margin = [&](const Vector6d& v) {
    const InverseResult r =
        inverse_kinematics(geometry, rest, geometry.B_from_P(Pose::from_vector(v)), {.singularity = false});
    return r.verdict == PoseVerdict::reachable || r.verdict == PoseVerdict::too_long ||
                   r.verdict == PoseVerdict::too_short
               ? r.stroke_margin_mm
               : -1e300;
  };
  Vector6d at = Vector6d::Zero();
  double best = margin(at);
  for (double step = 128; step > 0.5; step /= 2) {
    for (bool better = true; better;) {
      better = false;
      for (Eigen::Index k = 0; k < 3; ++k) {
        for (const double way : {-step, step}) {
          const Vector6d next = at + way * Vector6d::Unit(k);
          const double value = margin(next);
          if (value > best) {
            best = value;
            at = next;
            better = true;
          }
        }
      }
    }
  }
  return Pose::from_vector(at);
}

// The five paths to their limits, then their pairs. Opposite paths make no pair, and tension and compression
// are counted in each other's unit: the share of the way to their own limit.
SampleResult sample_load_paths(const PlatformGeometry& geometry, const RestState& rest,
                               const SampleOptions& options) {
  std::vector<LoadPath> paths = options.load_paths;
  if (paths.empty()) {
    paths = {LoadPath::tension, LoadPath::compression, LoadPath::torsion, LoadPath::bending_x,
             LoadPath::bending_y};
  }
  std::vector<Vector6d> ways;
  const auto add = [&](const Vector6d& direction) {
    const double reach =
        reach_along(geometry, rest, Pose{}, direction, farthest(geometry, direction), options.margins);
    if (reach > 0) ways.emplace_back(direction * reach);
  };
  const auto is_turn = [](LoadPath p) { return p != LoadPath::tension && p != LoadPath::compression; };
  for (const LoadPath path : paths) {
    add(load_direction(path));
    if (is_turn(path)) add(-load_direction(path));
  }
  const std::vector<Vector6d> single = ways;
  for (std::size_t i = 0; options.combine && i < single.size(); ++i) {
    for (std::size_t j = i + 1; j < single.size(); ++j) {
      const Vector6d both = single[i] + single[j];
      // Opposite senses of one parameter cancel; they are no load.
      if ((single[i].cwiseProduct(single[j])).cwiseAbs().maxCoeff() == 0) add(both);
    }
  }
  SampleResult result;
  if (ways.empty()) return result;
  // Way after way in turn, at evenly spread depths; the seed decides where the even spacing starts.
  std::mt19937_64 random(options.seed);
  const double start = unit_interval(random);
  while (result.poses.size() < options.count && result.tries < 4 * options.count + ways.size()) {
    const std::size_t n = result.tries++;
    const double moved = start + radical_inverse(n / ways.size() + 1, 2);
    const double depth = (1 - (moved - std::floor(moved))) * options.load_fraction;
    // Adding zero takes the sign off zeros.
    const Pose pose = Pose::from_vector(ways[n % ways.size()] * depth + Vector6d::Zero());
    if (is_valid(geometry, rest, pose, options.margins)) result.poses.push_back(pose);
  }
  return result;
}

}  // namespace

void PoseMargins::validate() const {
  const std::array<std::pair<const char*, double>, 5> fields{{{"stroke_mm", stroke_mm},
                                                              {"joint_rad", joint_rad},
                                                              {"clearance_mm", clearance_mm},
                                                              {"singular_mm", singular_mm},
                                                              {"singular_rad", singular_rad}}};
  for (const auto& [field, value] : fields) {
    if (!(value >= 0)) throw InputError(std::string("PoseMargins.") + field + " must not be negative");
  }
}

void SampleOptions::validate() const {
  margins.validate();
  if (!(load_fraction > 0 && load_fraction <= 1))
    throw InputError("SampleOptions.load_fraction must lie in (0, 1]");
  if (box && !((box->upper - box->lower).minCoeff() >= 0 && box->lower.allFinite() && box->upper.allFinite()))
    throw InputError("SampleOptions.box must have finite upper values that are not below the lower ones");
}

bool is_valid(const PlatformGeometry& geometry, const RestState& rest, const Pose& pose,
              const PoseMargins& margins) {
  const Rigid3 B_from_P = geometry.B_from_P(pose);
  // The cheap limits first: most candidates fall there.
  const LegVector lengths = leg_lengths(geometry, B_from_P);
  const double slack_mm = geometry.screw ? std::abs(geometry.screw->lead_mm) : 0;
  for (std::size_t i = 0; i < 6; ++i) {
    const double length = lengths[static_cast<Eigen::Index>(i)];
    const Actuator& a = geometry.actuators[i];
    if (!(length >= a.min_mm + margins.stroke_mm - slack_mm &&
          length <= a.max_mm - margins.stroke_mm + slack_mm))
      return false;
  }
  const InverseResult result = inverse_kinematics(geometry, rest, B_from_P, {.singularity = false});
  if (!(result.reachable() && result.stroke_margin_mm >= margins.stroke_mm &&
        result.joint_margin_rad >= margins.joint_rad && result.clearance_mm >= margins.clearance_mm))
    return false;
  const SingularityMeasures singularity = singularity_measures(geometry, rest.home_singularity, B_from_P);
  return !singularity.near_singular && singularity.distance_mm >= margins.singular_mm &&
         singularity.distance_deg * kRadPerDeg >= margins.singular_rad;
}

double reach_along(const PlatformGeometry& geometry, const RestState& rest, const Pose& from,
                   const Vector6d& direction, double limit, const PoseMargins& margins, int steps) {
  const Vector6d start = from.vector();
  const auto valid = [&](double s) {
    return is_valid(geometry, rest, Pose::from_vector(start + s * direction), margins);
  };
  if (!valid(0)) return 0;
  double good = 0;
  double bad = limit;
  bool met = false;
  for (int i = 1; i <= steps && !met; ++i) {
    const double s = limit * i / steps;
    met = !valid(s);
    (met ? bad : good) = s;
  }
  for (int i = 0; met && i < 40; ++i) {
    const double middle = 0.5 * (good + bad);
    (valid(middle) ? good : bad) = middle;
  }
  return good;
}

PoseBox workspace_box(const PlatformGeometry& geometry, const PoseMargins& margins) {
  const RestState rest(geometry);
  SampleOptions pilot;
  pilot.kind = SampleKind::halton;
  pilot.count = 400;
  pilot.largest_tries = 20000;
  pilot.margins = margins;
  const Pose middle = most_central(geometry, rest);
  PoseBox box;
  for (Eigen::Index k = 0; k < 6; ++k) {
    const Vector6d axis = Vector6d::Unit(k);
    const double limit = farthest(geometry, axis);
    const double at = middle.vector()[k];
    box.upper[k] = std::max(0.0, at + reach_along(geometry, rest, middle, axis, limit, margins));
    box.lower[k] = std::min(0.0, at - reach_along(geometry, rest, middle, -axis, limit, margins));
  }
  // The farthest x is seldom reached at the middle's z: widen while samples fall into the added rim.
  for (int round = 0; round < 5; ++round) {
    const PoseBox wide = widened(box, 0.2);
    PoseBox hull = box;
    for (const Pose& pose : sample_box(geometry, rest, pilot, wide).poses) {
      hull.lower = hull.lower.cwiseMin(pose.vector());
      hull.upper = hull.upper.cwiseMax(pose.vector());
    }
    const bool still = hull.lower == box.lower && hull.upper == box.upper;
    box = hull;
    if (still) break;
  }
  return widened(box, 0.1);
}

const char* name(LoadPath path) {
  switch (path) {
    case LoadPath::tension:
      return "tension";
    case LoadPath::compression:
      return "compression";
    case LoadPath::torsion:
      return "torsion";
    case LoadPath::bending_x:
      return "bending_x";
    case LoadPath::bending_y:
      return "bending_y";
  }
  return "tension";
}

Vector6d load_direction(LoadPath path) {
  switch (path) {
    case LoadPath::tension:
      return -Vector6d::Unit(2);
    case LoadPath::compression:
      return Vector6d::Unit(2);
    case LoadPath::torsion:
      return Vector6d::Unit(5);
    case LoadPath::bending_x:
      return Vector6d::Unit(3);
    case LoadPath::bending_y:
      return Vector6d::Unit(4);
  }
  return Vector6d::Zero();
}

SampleResult sample_poses(const PlatformGeometry& geometry, const SampleOptions& options) {
  options.validate();
  const RestState rest(geometry);
  if (options.kind == SampleKind::load_paths) return sample_load_paths(geometry, rest, options);
  return sample_box(geometry, rest, options,
                    options.box ? *options.box : workspace_box(geometry, options.margins));
}

}  // namespace hexcal
