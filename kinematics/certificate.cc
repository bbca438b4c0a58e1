#include "kinematics/certificate.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

#include "kinematics/forward.h"
#include "kinematics/geometry/input_error.h"
#include "kinematics/interval.h"
#include "kinematics/newton.h"

namespace hexcal {
namespace {

using Box = std::array<Interval, 6>;  // x, y, z mm, roll, pitch, yaw rad
using Row = std::array<Interval, 6>;

// Six equations |R b + t - a|^2 - length^2 = 0 with a in the home frame and b in LG, so that (R, t) is the
// pose itself.
struct Equations {
  std::array<std::array<Interval, 3>, 6> a;
  std::array<std::array<Interval, 3>, 6> b;
  std::array<Interval, 6> squared_length;
  double unit_mm = 1;  // weighs angles against lengths
};

Equations equations_of(const PlatformGeometry& geometry, const LegVector& lengths_mm) {
  // Moving the joints into these frames rounds them; a few units of the largest number on the way cover that.
  const Rigid3 home_from_B = inverse(geometry.B_from_UG * Rigid3::from_translation({0, 0, -geometry.gd_mm}));
  const Rigid3 LG_from_P = inverse(geometry.P_from_LG);
  Equations e;
  double sum = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    const Eigen::Vector3d a = home_from_B * geometry.base_joints_mm[i];
    const Eigen::Vector3d b = LG_from_P * geometry.platform_joints_mm[i];
    const double a_error = 1e-15 * (geometry.base_joints_mm[i].norm() + home_from_B.translation.norm());
    const double b_error = 1e-15 * (geometry.platform_joints_mm[i].norm() + LG_from_P.translation.norm());
    for (int k = 0; k < 3; ++k) {
      const auto n = static_cast<std::size_t>(k);
      e.a[i][n] = Interval(a[k] - a_error, a[k] + a_error);
      e.b[i][n] = Interval(b[k] - b_error, b[k] + b_error);
    }
    e.squared_length[i] = square(Interval(lengths_mm[static_cast<Eigen::Index>(i)]));
    sum += b.squaredNorm();
  }
  e.unit_mm = std::sqrt(sum / 6);
  return e;
}

using Matrix3 = std::array<std::array<Interval, 3>, 3>;

// R = Rz(yaw) Ry(pitch) Rx(roll), and the axes about which roll, pitch and yaw turn the platform, in the home
// frame.
struct Turn {
  Matrix3 r;
  Matrix3 axis;  // axis[k]: of parameter k
};

Turn turn_of(const Interval& roll, const Interval& pitch, const Interval& yaw) {
  const Interval cr = cosine(roll);
  const Interval sr = sine(roll);
  const Interval cp = cosine(pitch);
  const Interval sp = sine(pitch);
  const Interval cy = cosine(yaw);
  const Interval sy = sine(yaw);
  Turn t;
  const Interval cysp = cy * sp;
  const Interval sysp = sy * sp;
  t.r[0] = {cy * cp, cysp * sr - sy * cr, cysp * cr + sy * sr};
  t.r[1] = {sy * cp, sysp * sr + cy * cr, sysp * cr - cy * sr};
  t.r[2] = {-sp, cp * sr, cp * cr};
  t.axis[0] = {t.r[0][0], t.r[1][0], t.r[2][0]};
  t.axis[1] = {-sy, cy, Interval(0)};
  t.axis[2] = {Interval(0), Interval(0), Interval(1)};
  return t;
}

std::array<Interval, 3> rotated(const Matrix3& r, const std::array<Interval, 3>& b) {
  std::array<Interval, 3> out;
  for (std::size_t k = 0; k < 3; ++k) out[k] = r[k][0] * b[0] + r[k][1] * b[1] + r[k][2] * b[2];
  return out;
}

// Residuals over a box; tells at once if one of them cannot vanish.
bool may_vanish(const Equations& e, const Box& box, const Turn& turn) {
  for (std::size_t i = 0; i < 6; ++i) {
    const std::array<Interval, 3> arm = rotated(turn.r, e.b[i]);
    Interval sum = square(arm[0] + box[0] - e.a[i][0]);
    sum += square(arm[1] + box[1] - e.a[i][1]);
    sum += square(arm[2] + box[2] - e.a[i][2]);
    if (!sum.meets(e.squared_length[i])) return false;
  }
  return true;
}

// Half the gradient of each equation over the box: (d, (axis_k x arm) . d).
std::array<Row, 6> half_jacobian(const Equations& e, const Box& box, const Turn& turn) {
  std::array<Row, 6> j;
  for (std::size_t i = 0; i < 6; ++i) {
    const std::array<Interval, 3> arm = rotated(turn.r, e.b[i]);
    std::array<Interval, 3> to_base;  // d = arm + to_base, and (axis x arm) . d = axis . (arm x to_base)
    for (std::size_t k = 0; k < 3; ++k) {
      to_base[k] = box[k] - e.a[i][k];
      j[i][k] = arm[k] + to_base[k];
    }
    const std::array<Interval, 3> moment{arm[1] * to_base[2] - arm[2] * to_base[1],
                                         arm[2] * to_base[0] - arm[0] * to_base[2],
                                         arm[0] * to_base[1] - arm[1] * to_base[0]};
    j[i][3] = turn.axis[0][0] * moment[0] + turn.axis[0][1] * moment[1] + turn.axis[0][2] * moment[2];
    j[i][4] = turn.axis[1][0] * moment[0] + turn.axis[1][1] * moment[1];
    j[i][5] = moment[2];
  }
  return j;
}

std::array<Interval, 6> half_residuals(const Equations& e, const Box& at) {
  const Turn turn = turn_of(at[3], at[4], at[5]);
  std::array<Interval, 6> f;
  for (std::size_t i = 0; i < 6; ++i) {
    const std::array<Interval, 3> arm = rotated(turn.r, e.b[i]);
    Interval sum(0);
    for (std::size_t k = 0; k < 3; ++k) sum += square(arm[k] + at[k] - e.a[i][k]);
    f[i] = 0.5 * (sum - e.squared_length[i]);
  }
  return f;
}

enum class Contraction { empty, unique, smaller, stuck };

// One Hansen-Sengupta sweep. `unique`: the box holds exactly one pose, and now encloses it more tightly.
Contraction contract(const Equations& e, Box& box) {
  const Turn turn = turn_of(box[3], box[4], box[5]);
  if (!may_vanish(e, box, turn)) return Contraction::empty;
  const std::array<Row, 6> j = half_jacobian(e, box, turn);
  Matrix6d middle;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t k = 0; k < 6; ++k)
      middle(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) = j[i][k].middle();
  }
  const Matrix6d c = middle.inverse();
  if (!c.allFinite()) return Contraction::stuck;
  Box centre;
  for (std::size_t k = 0; k < 6; ++k) centre[k] = Interval(box[k].middle());
  const std::array<Interval, 6> f = half_residuals(e, centre);
  bool all_inside = true;
  bool smaller = false;
  for (std::size_t i = 0; i < 6; ++i) {
    Interval sum(0);
    Interval pivot(0);
    for (std::size_t n = 0; n < 6; ++n)
      sum += c(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(n)) * f[n];
    for (std::size_t k = 0; k < 6; ++k) {
      Interval entry(0);
      for (std::size_t n = 0; n < 6; ++n)
        entry += c(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(n)) * j[n][k];
      if (k == i) {
        pivot = entry;
      } else {
        sum += entry * (box[k] - centre[k]);
      }
    }
    if (pivot.contains(0)) {
      // No quotient; but if nothing in the box balances the row, the box is empty.
      if (!(sum + pivot * (box[i] - centre[i])).contains(0)) return Contraction::empty;
      all_inside = false;
      continue;
    }
    const Interval image = centre[i] - sum / pivot;
    if (!image.meets(box[i])) return Contraction::empty;
    all_inside = all_inside && image.inside(box[i]);
    const Interval rest = intersection(image, box[i]);
    smaller = smaller || rest.width() < 0.7 * box[i].width();
    box[i] = rest;
  }
  if (all_inside) return Contraction::unique;
  return smaller ? Contraction::smaller : Contraction::stuck;
}

bool within(const Box& inner, const Box& outer) {
  for (std::size_t k = 0; k < 6; ++k) {
    if (!inner[k].within(outer[k])) return false;
  }
  return true;
}

bool meets(const Box& a, const Box& b) {
  for (std::size_t k = 0; k < 6; ++k) {
    if (!a[k].meets(b[k])) return false;
  }
  return true;
}

Box around(const Vector6d& pose, double mm, double rad) {
  Box box;
  for (std::size_t k = 0; k < 6; ++k) {
    const double radius = k < 3 ? mm : rad;
    const double value = pose[static_cast<Eigen::Index>(k)];
    box[k] = Interval(value - radius, value + radius);
  }
  return box;
}

// A root: a large box proven to hold exactly one pose, and a small one that encloses it.
struct Root {
  Box domain;
  Box enclosure;
};

// The largest of a few boxes around the pose that is proven to hold exactly one root.
std::optional<Root> verified(const Equations& e, const Vector6d& pose) {
  for (double mm = 0.02 * e.unit_mm * 4; mm > 1e-9 * e.unit_mm; mm *= 0.6) {
    const Box domain = around(pose, mm, mm / e.unit_mm * 0.6);
    Box enclosure = domain;
    if (contract(e, enclosure) != Contraction::unique) continue;
    for (int i = 0; i < 8; ++i) {
      const double before = enclosure[0].width();
      if (contract(e, enclosure) == Contraction::empty) return std::nullopt;  // cannot be: a root is inside
      if (enclosure[0].width() > 0.5 * before) break;
    }
    return Root{domain, enclosure};
  }
  return std::nullopt;
}

// Beyond these angles one pose would have several triples of angles.
bool is_proper(const PoseBox& box) {
  const Vector6d largest = (Vector6d() << 1e6, 1e6, 1e6, 180, 89, 180).finished();
  for (Eigen::Index k = 0; k < 6; ++k) {
    const double limit = largest[k] * (k < 3 ? 1 : kRadPerDeg);
    if (!(box.lower[k] <= box.upper[k] && box.lower[k] >= -limit && box.upper[k] <= limit)) return false;
  }
  return true;
}

}  // namespace

const char* name(CertificateStatus status) {
  switch (status) {
    case CertificateStatus::unique:
      return "unique";
    case CertificateStatus::several:
      return "several";
    case CertificateStatus::none:
      return "none";
    case CertificateStatus::undecided:
      return "undecided";
  }
  return "undecided";
}

void CertificateOptions::validate() const {
  if (largest_boxes < 1) throw InputError("CertificateOptions.largest_boxes must be at least 1");
  if (!(smallest_mm > 0)) throw InputError("CertificateOptions.smallest_mm must be greater than zero");
}

PoseBox default_certificate_box() {
  PoseBox box;
  box.upper << 150, 150, 150, 20 * kRadPerDeg, 20 * kRadPerDeg, 20 * kRadPerDeg;
  box.lower = -box.upper;
  return box;
}

Certificate certify(const PlatformGeometry& geometry, const LegVector& lengths_mm, const Pose& pose,
                    const PoseBox& pose_box, const CertificateOptions& options) {
  options.validate();
  Certificate result;
  if (geometry.screw && geometry.screw->lead_mm != 0) {
    result.reason = "a machine with a screw lead is not handled";
    return result;
  }
  if (!lengths_mm.allFinite() || !pose.vector().allFinite()) {
    result.reason = "the lengths or the pose are not finite";
    return result;
  }
  if (!is_proper(pose_box)) {
    result.reason = "the box is not finite, is empty, or has angles beyond +-180 deg (pitch: +-89 deg)";
    return result;
  }
  const Equations e = equations_of(geometry, lengths_mm);
  const LegArray legs(geometry);
  Box whole;
  for (std::size_t k = 0; k < 6; ++k) {
    const auto n = static_cast<Eigen::Index>(k);
    whole[k] = Interval(pose_box.lower[n], pose_box.upper[n]);
  }
  std::vector<Root> roots;
  // Newton's method from a point, then the proof around where it ends. True if that gave a root not known
  // before.
  const auto learn = [&](const Vector6d& start) {
    const NewtonResult solve = newton(legs, lengths_mm, geometry.B_from_P(Pose::from_vector(start)));
    if (!solve.converged) return false;
    Vector6d at = geometry.pose_from_B_from_P(solve.B_from_P).vector();
    for (Eigen::Index k = 3; k < 6; ++k) at[k] = start[k] + wrap_angle(at[k] - start[k]);
    const Box point = around(at, 0, 0);
    for (const Root& known : roots) {
      if (within(point, known.domain)) return false;
    }
    const std::optional<Root> root = verified(e, at);
    if (root) roots.push_back(*root);
    return root.has_value();
  };
  (void)learn(pose.vector());

  std::vector<Box> stack{whole};
  std::string undecided;
  while (!stack.empty()) {
    Box box = stack.back();
    stack.pop_back();
    if (++result.boxes > options.largest_boxes) {
      undecided = "the search ran out of boxes";
      break;
    }
    const auto is_known = [&roots](const Box& b) {
      for (const Root& root : roots) {
        if (within(b, root.domain)) return true;
      }
      return false;
    };
    Contraction c = Contraction::smaller;
    Box tested = box;
    while (c == Contraction::smaller && !is_known(box)) {
      tested = box;
      c = contract(e, box);
    }
    if (c == Contraction::empty || is_known(box)) continue;
    std::size_t widest = 0;
    double width = 0;
    for (std::size_t k = 0; k < 6; ++k) {
      const double size = box[k].width() * (k < 3 ? 1 : e.unit_mm);
      if (size > width) {
        width = size;
        widest = k;
      }
    }
    if (c == Contraction::unique || width < 0.01 * e.unit_mm) {
      Vector6d centre;
      for (std::size_t k = 0; k < 6; ++k) centre[static_cast<Eigen::Index>(k)] = box[k].middle();
      if (learn(centre)) {
        stack.push_back(box);
        continue;
      }
      // Exactly one root in `tested`. If it encloses a known one, that is it.
      if (c == Contraction::unique) {
        bool same = false;
        bool apart = true;
        for (const Root& known : roots) {
          same = same || within(known.enclosure, tested);
          apart = apart && !meets(known.enclosure, tested);
        }
        if (apart) roots.push_back({tested, box});
        if (apart || same) continue;
      }
    }
    if (width < options.smallest_mm) {
      undecided = "a pose in the box is too near a singularity";
      continue;
    }
    Box half = box;
    const double middle = box[widest].middle();
    half[widest].lower = middle;
    box[widest].upper = middle;
    stack.push_back(half);
    stack.push_back(box);
  }

  // A root counts if its enclosure meets the box; one on the border counts as inside.
  std::vector<Vector6d> inside;
  std::vector<Box> counted;
  for (const Root& root : roots) {
    if (!meets(root.enclosure, whole)) continue;
    // Two domains may overlap around one root.
    if (std::any_of(counted.begin(), counted.end(), [&root](const Box& b) { return within(b, root.domain); }))
      continue;
    counted.push_back(root.enclosure);
    Vector6d centre;
    for (std::size_t k = 0; k < 6; ++k) centre[static_cast<Eigen::Index>(k)] = root.enclosure[k].middle();
    inside.push_back(centre);
  }
  const Vector6d wanted = pose.vector();
  std::stable_sort(inside.begin(), inside.end(), [&wanted](const Vector6d& l, const Vector6d& r) {
    return (l - wanted).squaredNorm() < (r - wanted).squaredNorm();
  });
  for (const Vector6d& root : inside) result.poses.push_back(Pose::from_vector(root));
  if (result.poses.size() > 1) {
    result.status = CertificateStatus::several;
  } else if (!undecided.empty()) {
    result.reason = undecided;
  } else if (result.poses.empty()) {
    result.status = CertificateStatus::none;
  } else if (pose_error(result.poses[0], pose).head<3>().norm() > 1e-6 * e.unit_mm ||
             pose_error(result.poses[0], pose).tail<3>().norm() > 1e-6) {
    result.reason = "one pose is in the box, but not the given one";
  } else {
    result.status = CertificateStatus::unique;
  }
  return result;
}

}  // namespace hexcal
