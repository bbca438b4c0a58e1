#include "calibration/machine_doubt.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <functional>

#include "calibration/calibrate.h"
#include "tests/calibration/virtual_machine.h"
#include "tests/support/hexapods.h"

namespace hexcal {
namespace {

using ::testing::HasSubstr;

constexpr TargetBox kBox{30, 25, 10};

ObservationSet campaign_of(const MachineModel& machine, std::size_t poses, double noise_mm, unsigned seed) {
  const PlatformGeometry nominal = surrogate_hexapod();
  return measured(machine, nominal, random_poses(poses, kBox, seed),
                  {noise_mm, noise_mm / 180 * kDegPerRad, seed});
}

void change_poses(ObservationSet& set, const std::function<Pose(const Pose&)>& change) {
  for (PoseObservation& pose : set.poses) pose.measured = change(pose.measured);
}

Eigen::Matrix3d matrix_of(const Pose& pose) { return home_from_lg(pose).rotation_matrix(); }

// Bad machines are what this program is for: none is doubted, however many poses and whatever the noise.
TEST(MachineDoubt, ABadMachineIsNoSlip) {
  const PlatformGeometry nominal = surrogate_hexapod();
  for (unsigned seed = 1; seed <= 2; ++seed) {
    const MachineModel ordinary = as_built(nominal, {1, 1, 0.005}, seed);
    const MachineModel papers = as_built_like_the_paper(nominal, kBox, seed);
    const MachineModel exact{.geometry = nominal};
    for (const MachineModel* machine : {&ordinary, &papers, &exact}) {
      for (const std::size_t poses : {5, 9, 34}) {
        for (const double noise_mm : {0.005, 0.425}) {
          // They take the time.
          if (poses == 34 && (seed > 1 || machine != &papers || noise_mm > 0.1)) continue;
          const CalibrationReport report =
              calibrate(nominal, campaign_of(*machine, poses, noise_mm, 10 * seed + 1));
          EXPECT_FALSE(report.doubt) << seed << ", " << poses << " poses, " << noise_mm
                                     << " mm: " << report.doubt->cause();
        }
      }
    }
  }
}

struct Slip {
  const char* name;
  std::function<void(PlatformGeometry&, ObservationSet&)> make;
  const char* words;  ///< what the doubt has to name; empty: it is enough that there is one
};

std::vector<Slip> slips() {
  const auto poses = [](std::function<Pose(const Pose&)> change) {
    return [change](PlatformGeometry&, ObservationSet& set) { change_poses(set, change); };
  };
  const auto axes = [poses](const Eigen::Matrix3d& s) {
    return poses([s](const Pose& pose) {
      return pose_from_home_from_lg(Rigid3(s * matrix_of(pose) * s.transpose(), s * pose.position_mm));
    });
  };
  const auto sign = [poses](Eigen::Index k) {
    return poses([k](const Pose& pose) {
      Vector6d v = pose.vector();
      v[k] = -v[k];
      return Pose::from_vector(v);
    });
  };
  const auto scaled = [poses](double factor) {
    return poses([factor](Pose pose) {
      pose.position_mm *= factor;
      return pose;
    });
  };
  const auto shifted = [](int shift) {
    return [shift](PlatformGeometry&, ObservationSet& set) {
      std::vector<Pose> taken;
      for (const PoseObservation& pose : set.poses) taken.push_back(pose.measured);
      std::rotate(taken.begin(), taken.begin() + shift, taken.end());
      for (std::size_t i = 0; i < taken.size(); ++i) set.poses[i].measured = taken[i];
    };
  };
  const Eigen::Vector3d up(0, 0, 1);
  const auto turn = [](double deg, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(deg * kRadPerDeg, axis).toRotationMatrix();
  };
  Eigen::Matrix3d mirror_y = Eigen::Vector3d(1, -1, 1).asDiagonal();
  Eigen::Matrix3d yz;
  yz << 1, 0, 0, 0, 0, 1, 0, 1, 0;
  return {
      {"y mirrored", axes(mirror_y), "left-handed frame"},
      {"y and z exchanged", axes(yz), "x, z, y"},
      {"z down", axes(turn(180, {1, 0, 0})), "x, -y, -z"},
      {"turned by 90 deg", axes(turn(90, up)), "the machine's"},
      {"pitch's sign", sign(4), "pitch has the other sign"},
      {"x's sign", sign(0), "x has the other sign"},
      {"yaw's sign", sign(5), "yaw has the other sign"},
      {"inches", scaled(1 / 25.4), "in inches"},
      {"cm", scaled(0.1), "in centimetres"},
      {"um", scaled(1000), "in um"},
      {"a print 20 % too large", scaled(1.2), "another scale"},
      {"targets in inches", scaled(25.4), "targets' positions are in inches"},
      {"radians", poses([](Pose pose) {
         pose.rpy_rad *= kRadPerDeg;
         return pose;
       }),
       "in radians"},
      {"inverse", poses([](const Pose& pose) { return pose_from_home_from_lg(inverse(home_from_lg(pose))); }),
       "inverse"},
      {"rotation vector", poses([](Pose pose) {
         const Eigen::AngleAxisd r(matrix_of(pose));
         pose.rpy_rad = r.angle() * r.axis();
         return pose;
       }),
       "rotation vector"},
      {"Rx Ry Rz", poses([](Pose pose) {
         pose.rpy_rad = matrix_of(pose).eulerAngles(0, 1, 2);
         if (std::abs(pose.rpy_rad[0]) > 1.5) {  // Eigen's first angle is in 0 .. pi
           pose.rpy_rad = {wrap_angle(pose.rpy_rad[0] + M_PI), wrap_angle(M_PI - pose.rpy_rad[1]),
                           wrap_angle(pose.rpy_rad[2] + M_PI)};
         }
         return pose;
       }),
       "Rx(..) Ry(..) Rz(..)"},
      {"yaw first in the table", poses([](Pose pose) {
         std::swap(pose.rpy_rad[0], pose.rpy_rad[2]);
         return pose;
       }),
       "the sequence"},
      {"names shifted", shifted(1), "shifted by 1"},
      {"names shifted by two", shifted(2), "shifted by 2"},
      {"names reversed",
       [](PlatformGeometry&, ObservationSet& set) {
         std::vector<Pose> taken;
         for (const PoseObservation& pose : set.poses) taken.push_back(pose.measured);
         for (std::size_t i = 0; i < taken.size(); ++i) set.poses[i].measured = taken[taken.size() - 1 - i];
       },
       "reverse order"},
      {"home leans by 6 deg", poses([turn](const Pose& pose) {
         const Rigid3 lean(turn(6, {1, 0, 0}), Eigen::Vector3d::Zero());
         return pose_from_home_from_lg(lean * home_from_lg(pose) * inverse(lean));
       }),
       "other frames"},
      {"measured in the room's frame", poses([turn](const Pose& pose) {
         const Rigid3 room(turn(70, Eigen::Vector3d(1, 2, 3).normalized()), {400, -200, 900});
         return pose_from_home_from_lg(room * home_from_lg(pose));
       }),
       "other frames"},
      {"joints numbered from the next one",
       [](PlatformGeometry& g, ObservationSet&) {
         std::rotate(g.base_joints_mm.begin(), g.base_joints_mm.begin() + 2, g.base_joints_mm.end());
         std::rotate(g.platform_joints_mm.begin(), g.platform_joints_mm.begin() + 2,
                     g.platform_joints_mm.end());
       },
       ""},
      {"readings of legs 2 and 5 exchanged",
       [](PlatformGeometry&, ObservationSet& set) {
         for (PoseObservation& pose : set.poses) std::swap(pose.readings[1], pose.readings[4]);
       },
       "legs 2 and 5 are exchanged"},
      {"another zero",
       [](PlatformGeometry&, ObservationSet& set) {
         for (PoseObservation& pose : set.poses) pose.readings.array() -= 60;
       },
       "another zero"},
      {"the platform's joints turned",
       [turn](PlatformGeometry& g, ObservationSet&) {
         for (auto& joint : g.platform_joints_mm) joint = turn(60, {0, 0, 1}) * joint;
       },
       "platform_joints_mm is turned by 60 deg"},
  };
}

// Each slip is refused and, where it can be told, named; with a machine of the usual make and 12 poses.
TEST(MachineDoubt, NoSlipLeavesACommand) {
  const MachineModel machine = as_built(surrogate_hexapod(), {1, 1, 0.005}, 5);
  for (const Slip& slip : slips()) {
    PlatformGeometry nominal = surrogate_hexapod();
    ObservationSet set = campaign_of(machine, 12, 0.01, 77);
    slip.make(nominal, set);
    const CalibrationReport report = calibrate(nominal, set);
    ASSERT_TRUE(report.doubt) << slip.name << ": " << report.chosen;
    EXPECT_THAT(report.doubt->cause(), HasSubstr(slip.words)) << slip.name;
    EXPECT_FALSE(report.doubt->instruction.empty()) << slip.name;
    EXPECT_EQ(report.fitted.model.method, CompensationMethod::nominal) << slip.name;
    for (const CorrectedCommand& command : corrected_commands(report, {{"t", Pose{}}})) {
      EXPECT_EQ(command.status, CommandStatus::withheld) << slip.name;
      EXPECT_FALSE(command.readings || command.predicted) << slip.name;
    }
  }
}

// Where the frames are said to be unknown, other frames are no slip but units and hands still are.
TEST(MachineDoubt, UnknownFramesAreNoExcuseForUnits) {
  const PlatformGeometry nominal = surrogate_hexapod();
  const MachineModel machine = as_built(nominal, {1, 1, 0.005}, 6);
  const Rigid3 room(Eigen::AngleAxisd(1.2, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix(),
                    {400, -200, 900});
  CalibrateOptions options;
  options.identify.frames_unknown = true;
  const auto doubt = [&](double factor, bool mirror) {
    ObservationSet set = campaign_of(machine, 14, 0.01, 78);
    change_poses(set, [&](const Pose& pose) {
      Rigid3 seen = room * home_from_lg(pose);
      if (mirror) {
        const Eigen::Matrix3d s = Eigen::Vector3d(1, -1, 1).asDiagonal();
        seen = Rigid3(s * seen.rotation_matrix() * s, s * seen.translation);
      }
      return pose_from_home_from_lg(Rigid3(seen.rotation_matrix(), factor * seen.translation));
    });
    return calibrate(nominal, set, options).doubt;
  };
  EXPECT_FALSE(doubt(1, false));
  const auto metres = doubt(0.001, false);
  ASSERT_TRUE(metres);
  EXPECT_THAT(metres->cause(), HasSubstr("in metres"));
  const auto mirrored = doubt(1, true);
  ASSERT_TRUE(mirrored);
  EXPECT_THAT(mirrored->cause(), HasSubstr("left-handed"));
}

}  // namespace
}  // namespace hexcal
