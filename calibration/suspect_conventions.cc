#include "calibration/suspect_conventions.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string_view>
#include <utility>

namespace hexcal {
namespace {

using Undo = decltype(SuspectConvention::undo);

// Poses that the slips can be undone in: all six coordinates measured.
ObservationSet complete_poses(const ObservationSet& observations) {
  ObservationSet out;
  out.covariance_known = observations.covariance_known;
  for (const PoseObservation& pose : observations.poses) {
    if (!pose.complete()) continue;
    out.poses.push_back(pose);
  }
  return out;
}

// Another reading of each measured pose.
Undo of_each_pose(std::function<Pose(const Pose&)> change) {
  return [change = std::move(change)](const PlatformGeometry& nominal, const ObservationSet& observations) {
    ReadOtherwise other{nominal, complete_poses(observations)};
    for (PoseObservation& pose : other.observations.poses) pose.measured = change(pose.measured);
    return std::optional(std::move(other));
  };
}

// Another reading of each pose's legs.
Undo of_readings(std::function<LegVector(const PlatformGeometry&, const LegVector&)> change) {
  return [change = std::move(change)](const PlatformGeometry& nominal, const ObservationSet& observations) {
    ReadOtherwise other{nominal, complete_poses(observations)};
    for (PoseObservation& pose : other.observations.poses) pose.readings = change(nominal, pose.readings);
    return std::optional(std::move(other));
  };
}

Undo of_drawing(std::function<void(PlatformGeometry&)> change) {
  return [change = std::move(change)](const PlatformGeometry& nominal, const ObservationSet& observations) {
    ReadOtherwise other{nominal, complete_poses(observations)};
    change(other.nominal);
    return geometry_fault(other.nominal) ? std::nullopt : std::optional(std::move(other));
  };
}

// Positions divided by their mean ratio to the targets', where that is far from 1.
std::optional<ReadOtherwise> in_the_targets_scale(const PlatformGeometry& nominal,
                                                  const ObservationSet& observations) {
  constexpr double kFarFromOne = 0.05;
  ReadOtherwise other{nominal, complete_poses(observations)};
  Eigen::Vector3d measured = Eigen::Vector3d::Zero();
  Eigen::Vector3d wanted = Eigen::Vector3d::Zero();
  double count = 0;
  for (const PoseObservation& pose : other.observations.poses) {
    if (!pose.target) continue;
    measured += pose.measured.position_mm;
    wanted += pose.target->position_mm;
    count += 1;
  }
  if (count == 0) return std::nullopt;
  double product = 0;
  double square = 0;
  for (const PoseObservation& pose : other.observations.poses) {
    if (!pose.target) continue;
    const Eigen::Vector3d target = pose.target->position_mm - wanted / count;
    product += target.dot(pose.measured.position_mm - measured / count);
    square += target.squaredNorm();
  }
  const double ratio = product / square;
  if (!(ratio > 0) || std::abs(ratio - 1) < kFarFromOne) return std::nullopt;
  for (PoseObservation& pose : other.observations.poses) pose.measured.position_mm /= ratio;
  return other;
}

void add_units(std::vector<SuspectConvention>& list) {
  struct Unit {
    const char* name;
    double mm;
  };
  for (const auto& [unit, mm] :
       {Unit{"inches", 25.4}, {"centimetres", 10}, {"metres", 1000}, {"um", 0.001}}) {
    list.push_back({fmt::format("the measured positions are in {}", unit), "write them in mm",
                    of_each_pose([mm = mm](Pose pose) {
                      pose.position_mm *= mm;
                      return pose;
                    })});
    list.push_back({fmt::format("the targets' positions are in {}, or everything that was measured is {} "
                                "times as large as it says",
                                unit, 1 / mm),
                    "write them in mm; where photographs were measured, look at the sizes and the scale in "
                    "campaign.yaml",
                    of_each_pose([mm = mm](Pose pose) {
                      pose.position_mm /= mm;
                      return pose;
                    })});
  }
  list.push_back({"everything that was measured has another scale than the targets",
                  "look at the sizes and the scale in campaign.yaml and at mm_per_unit in hexapod.yaml",
                  in_the_targets_scale});
  list.push_back({"the measured angles are in radians", "write them in degrees", of_each_pose([](Pose pose) {
                    pose.rpy_rad *= kDegPerRad;
                    return pose;
                  })});
  list.push_back({"the targets' angles are in radians", "write them in degrees", of_each_pose([](Pose pose) {
                    pose.rpy_rad *= kRadPerDeg;
                    return pose;
                  })});
}

void add_signs(std::vector<SuspectConvention>& list) {
  constexpr std::array<const char*, 6> kNames{"x", "y", "z", "roll", "pitch", "yaw"};
  for (Eigen::Index k = 0; k < 6; ++k) {
    list.push_back({fmt::format("{} has the other sign in the measured poses than in the targets",
                                kNames[static_cast<std::size_t>(k)]),
                    "turn it round in one of the two", of_each_pose([k](const Pose& pose) {
                      Vector6d v = pose.vector();
                      v[k] = -v[k];
                      return Pose::from_vector(v);
                    })});
  }
  list.push_back({"all angles have the other sign in the measured poses than in the targets",
                  "turn them round in one of the two", of_each_pose([](Pose pose) {
                    pose.rpy_rad = -pose.rpy_rad;
                    return pose;
                  })});
}

// The 47 other ways to name the axes of a frame: measured axis i is the machine's axis `axes[i]`, or its
// opposite. A rotation R becomes S R S^-1 also where S mirrors.
void add_axes(std::vector<SuspectConvention>& list) {
  constexpr std::array<char, 3> kAxis{'x', 'y', 'z'};
  struct Naming {
    int changes;
    SuspectConvention suspect;
  };
  std::vector<Naming> namings;
  std::array<int, 3> axes{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d named = Eigen::Matrix3d::Zero();  // machine's coordinates from the measured ones
      int changes = 0;
      std::string words;
      for (int i = 0; i < 3; ++i) {
        const bool opposite = (signs >> i & 1) != 0;
        const int axis = axes[static_cast<std::size_t>(i)];
        named(axis, i) = opposite ? -1 : 1;
        changes += (axis != i ? 1 : 0) + (opposite ? 1 : 0);
        words += fmt::format("{}{}{}", i == 0 ? "" : ", ", opposite ? "-" : "",
                             kAxis[static_cast<std::size_t>(axis)]);
      }
      if (changes == 0) continue;
      const bool mirrors = named.determinant() < 0;
      const std::string slip =
          mirrors ? fmt::format(
                        "the measured poses stand in a left-handed frame: their x, y, z are the "
                        "machine's {}",
                        words)
                  : fmt::format("the measured poses' axes x, y, z are the machine's {}", words);
      const auto change = [named](const Pose& pose) {
        const Eigen::Matrix3d r = named * home_from_lg(pose).rotation_matrix() * named.transpose();
        return pose_from_home_from_lg(Rigid3(r, named * pose.position_mm));
      };
      namings.push_back({changes,
                         {slip,
                          mirrors ? "use right-handed frames with the same axes for both"
                                  : "use the same axes for both, or `--frames unknown`",
                          of_each_pose(change), !mirrors}});
    }
  } while (std::next_permutation(axes.begin(), axes.end()));
  std::ranges::stable_sort(namings, {}, &Naming::changes);
  for (Naming& naming : namings) list.push_back(std::move(naming.suspect));
}

Eigen::Quaterniond about(int axis, double angle_rad) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::Unit(axis)));
}

// The measured angles, read by another rule. rpy_rad holds the columns as they stand in the table.
Undo of_angles(std::function<Eigen::Quaterniond(const Eigen::Vector3d&)> rotation) {
  return of_each_pose([rotation = std::move(rotation)](Pose pose) {
    pose.rpy_rad = rpy_from_quaternion(rotation(pose.rpy_rad));
    return pose;
  });
}

void add_rotations(std::vector<SuspectConvention>& list) {
  const char* const write_rpy = "write roll, pitch and yaw of R = Rz(yaw) Ry(pitch) Rx(roll)";
  list.push_back(
      {"the measured poses are inverse (home as LG sees it)", "invert them",
       of_each_pose([](const Pose& pose) { return pose_from_home_from_lg(inverse(home_from_lg(pose))); })});
  list.push_back({"the measured rotations are inverse", "invert them",
                  of_angles([](const Eigen::Vector3d& a) { return quaternion_from_rpy(a).conjugate(); })});
  list.push_back(
      {"the measured angles are a rotation vector", write_rpy, of_angles([](const Eigen::Vector3d& a) {
         const double angle = a.norm();
         return angle > 0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, a / angle))
                          : Eigen::Quaterniond::Identity();
       })});
  constexpr std::array<char, 3> kAxis{'x', 'y', 'z'};
  // Each angle stands under its axis, but they are applied in another order.
  std::array<int, 3> order{0, 1, 2};
  do {
    if (order == std::array{2, 1, 0}) continue;  // ours
    list.push_back(
        {fmt::format("the measured angles belong to R = R{}(..) R{}(..) R{}(..)",
                     kAxis[static_cast<std::size_t>(order[0])], kAxis[static_cast<std::size_t>(order[1])],
                     kAxis[static_cast<std::size_t>(order[2])]),
         write_rpy, of_angles([order](const Eigen::Vector3d& a) {
           return about(order[0], a[order[0]]) * about(order[1], a[order[1]]) * about(order[2], a[order[2]]);
         })});
  } while (std::next_permutation(order.begin(), order.end()));
  // The three columns are first, second and third angle of one of the 12 sequences, or the other way round.
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      for (int k = 0; k < 3; ++k) {
        if (i == j || j == k) continue;
        for (const bool backwards : {false, true}) {
          if (i == 0 && j == 1 && k == 2 && !backwards) continue;  // under its axes: above
          if (i == 2 && j == 1 && k == 0 && backwards) continue;   // ours
          list.push_back({fmt::format("the measured angles are those of the sequence {}{}{}, the {} first",
                                      kAxis[static_cast<std::size_t>(i)], kAxis[static_cast<std::size_t>(j)],
                                      kAxis[static_cast<std::size_t>(k)], backwards ? "last" : "first"),
                          write_rpy, of_angles([i, j, k, backwards](const Eigen::Vector3d& a) {
                            return about(i, a[backwards ? 2 : 0]) * about(j, a[1]) *
                                   about(k, a[backwards ? 0 : 2]);
                          })});
        }
      }
    }
  }
}

// Poses i with what was commanded at pose i + shift, or in the reverse order.
void add_names(std::vector<SuspectConvention>& list) {
  const auto paired = [](const ObservationSet& observations, auto partner) {
    const ObservationSet all = complete_poses(observations);
    std::vector<std::size_t> tests;  // the pose that defines home stays what it is
    ReadOtherwise other;
    other.observations.covariance_known = all.covariance_known;
    for (std::size_t i = 0; i < all.poses.size(); ++i) {
      if (all.poses[i].is_definition) {
        other.observations.poses.push_back(all.poses[i]);
      } else {
        tests.push_back(i);
      }
    }
    const auto n = static_cast<long>(tests.size());
    for (long i = 0; i < n; ++i) {
      const long j = partner(i, n);
      if (j < 0 || j >= n) continue;
      PoseObservation pose = all.poses[tests[static_cast<std::size_t>(i)]];
      const PoseObservation& commanded = all.poses[tests[static_cast<std::size_t>(j)]];
      pose.readings = commanded.readings;
      pose.approach = commanded.approach;
      pose.target = commanded.target;
      other.observations.poses.push_back(std::move(pose));
    }
    return other;
  };
  for (const int shift : {1, -1, 2, -2}) {
    list.push_back({fmt::format("the poses are shifted by {} against the targets (a pose measured as the "
                                "{}-th was commanded as the {}-th)",
                                std::abs(shift), 10, 10 + shift),
                    "look whether a pose was left out or photographed twice, and name the folders again",
                    [paired, shift](const PlatformGeometry& nominal, const ObservationSet& observations) {
                      ReadOtherwise other = paired(observations, [shift](long i, long) { return i + shift; });
                      other.nominal = nominal;
                      return std::optional(std::move(other));
                    }});
  }
  list.push_back({"the poses were measured in the reverse order of their names", "name the folders again",
                  [paired](const PlatformGeometry& nominal, const ObservationSet& observations) {
                    ReadOtherwise other = paired(observations, [](long i, long n) { return n - 1 - i; });
                    other.nominal = nominal;
                    return std::optional(std::move(other));
                  }});
}

// Readings whose mean residual at the measured poses is zero, leg by leg.
std::optional<ReadOtherwise> from_another_zero(const PlatformGeometry& nominal,
                                               const ObservationSet& observations) {
  ReadOtherwise other{nominal, complete_poses(observations)};
  if (other.observations.poses.empty()) return std::nullopt;
  LegVector mean = LegVector::Zero();
  for (const PoseObservation& pose : other.observations.poses) {
    mean +=
        leg_lengths(nominal, nominal.B_from_P(pose.measured)) - lengths_from_readings(nominal, pose.readings);
  }
  mean /= static_cast<double>(other.observations.poses.size());
  for (PoseObservation& pose : other.observations.poses)
    pose.readings = readings_from_lengths(nominal, lengths_from_readings(nominal, pose.readings) + mean);
  return other;
}

void add_legs(std::vector<SuspectConvention>& list) {
  list.push_back({"the readings count from another zero than hexapod.yaml says",
                  "correct offset_mm of its actuators", from_another_zero});
  list.push_back({"the readings grow as the legs get shorter", "give mm_per_unit the other sign",
                  [](const PlatformGeometry& nominal, const ObservationSet& observations) {
                    const auto turned = of_readings([](const PlatformGeometry& g, const LegVector& readings) {
                      return readings_from_lengths(g, -lengths_from_readings(g, readings));
                    })(nominal, observations);
                    return from_another_zero(nominal, turned->observations);
                  }});
  const char* const number_again = "number the legs in the order of hexapod.yaml";
  std::array<int, 6> order{};
  const auto add_order = [&](const std::string& slip) {
    list.push_back(
        {slip, number_again, of_readings([order](const PlatformGeometry&, const LegVector& readings) {
           LegVector out;
           for (std::size_t k = 0; k < 6; ++k) out[static_cast<Eigen::Index>(k)] = readings[order[k]];
           return out;
         })});
  };
  for (const bool reverse : {false, true}) {
    for (int shift = 0; shift < 6; ++shift) {
      if (!reverse && shift == 0) continue;
      std::string words;
      for (int k = 0; k < 6; ++k) {
        order[static_cast<std::size_t>(k)] = ((reverse ? 5 - k : k) + shift) % 6;
        words += fmt::format("{}{}", k == 0 ? "" : ", ", order[static_cast<std::size_t>(k)] + 1);
      }
      add_order(
          fmt::format("the readings' legs 1 to 6 are numbered otherwise than the joints (joint pairs 1 "
                      "to 6 belong to q{})",
                      words));
    }
  }
  for (int a = 0; a < 6; ++a) {
    for (int b = a + 1; b < 6; ++b) {
      std::iota(order.begin(), order.end(), 0);
      std::swap(order[static_cast<std::size_t>(a)], order[static_cast<std::size_t>(b)]);
      add_order(fmt::format("the readings of legs {} and {} are exchanged", a + 1, b + 1));
    }
  }
}

void add_drawings(std::vector<SuspectConvention>& list) {
  list.push_back(
      {"base_joints_mm and platform_joints_mm are exchanged", "exchange them in hexapod.yaml",
       of_drawing([](PlatformGeometry& g) { std::swap(g.base_joints_mm, g.platform_joints_mm); })});
  constexpr std::array<char, 3> kAxis{'x', 'y', 'z'};
  for (const bool base : {true, false}) {
    const char* const key = base ? "base_joints_mm" : "platform_joints_mm";
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      list.push_back({fmt::format("{} of {} has the other sign", kAxis[static_cast<std::size_t>(axis)], key),
                      fmt::format("correct {} in hexapod.yaml", key), of_drawing([=](PlatformGeometry& g) {
                        for (auto& joint : base ? g.base_joints_mm : g.platform_joints_mm)
                          joint[axis] = -joint[axis];
                      })});
    }
    for (const int turn_deg : {60, -60, 120, -120, 180, 90, -90}) {
      list.push_back({fmt::format("{} is turned by {} deg about z", key, -turn_deg),
                      fmt::format("correct {} in hexapod.yaml", key), of_drawing([=](PlatformGeometry& g) {
                        const Eigen::Quaterniond turn = about(2, turn_deg * kRadPerDeg);
                        for (auto& joint : base ? g.base_joints_mm : g.platform_joints_mm)
                          joint = turn * joint;
                      })});
    }
  }
}

}  // namespace

const std::vector<SuspectConvention>& suspect_conventions() {
  static const std::vector<SuspectConvention> list = [] {
    std::vector<SuspectConvention> out;
    add_units(out);
    add_signs(out);
    add_names(out);
    add_axes(out);
    add_rotations(out);
    add_legs(out);
    add_drawings(out);
    return out;
  }();
  return list;
}

}  // namespace hexcal
