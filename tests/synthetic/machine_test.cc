#include "tools/synthetic/machine.h"

#include <gmock/gmock.h>

#include "tests/support/error_matchers.h"
#include "tests/support/rigid_matchers.h"

namespace hexcal {
namespace {

TEST(VirtualMachine, WithoutErrorsReachesItsTargets) {
  MachineErrors none;
  none.joint_sigma_mm = none.leg_offset_sigma_mm = none.leg_scale_sigma = 0;
  const VirtualMachine machine = make_machine(1, none);
  for (const TargetPose& target : random_targets(machine, 1, 20, 30, 12 * kRadPerDeg)) {
    const auto pose =
        true_pose(machine, commanded_readings(machine.nominal, target.pose), machine.home_readings);
    ASSERT_TRUE(pose.has_value());
    EXPECT_THAT(home_from_lg(*pose), RigidNear(home_from_lg(target.pose), 1e-9, 1e-10)) << target.id;
  }
}

TEST(VirtualMachine, HomeIsZeroByDefinition) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    MachineErrors errors;
    errors.leg_compliance_mm_per_n = 1e-4;
    errors.stroke_wave_mm = 0.1;
    const VirtualMachine machine = make_machine(seed, errors);
    const auto home = true_pose(machine, machine.home_readings, machine.home_readings);
    ASSERT_TRUE(home.has_value());
    EXPECT_THAT(home_from_lg(*home), RigidNear(home_from_lg(Pose{}), 1e-9, 1e-10));
  }
}

TEST(VirtualMachine, ErrorsAreOfTheSizeOfThePapers) {
  double range_mm = 0;
  double range_deg = 0;
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6}) {
    const VirtualMachine machine = make_machine(seed, {});
    Vector6d low = Vector6d::Constant(1e9);
    Vector6d high = -low;
    for (const TargetPose& target : random_targets(machine, seed, 34, 30, 12 * kRadPerDeg)) {
      const LegVector readings = commanded_readings(machine.nominal, target.pose);
      const Vector6d error = pose_error(*true_pose(machine, readings, machine.home_readings), target.pose);
      low = low.cwiseMin(error);
      high = high.cwiseMax(error);
    }
    range_mm += (high - low).head<3>().norm() / std::sqrt(3.0) / 6;
    range_deg += (high - low).tail<3>().norm() / std::sqrt(3.0) / 6 * kDegPerRad;
  }
  EXPECT_GT(range_mm, 15);  // the paper: 19.7 mm
  EXPECT_LT(range_mm, 25);
  EXPECT_GT(range_deg, 8);  // the paper: 11.1 deg
  EXPECT_LT(range_deg, 14);
}

TEST(VirtualMachine, OneDrawFollowsTheSigmas) {
  MachineErrors errors;
  errors.joint_sigma_mm = errors.leg_offset_sigma_mm = 0.1;
  errors.leg_scale_sigma = 0.001;
  errors.draws = 1;
  double squares = 0;
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6, 7, 8}) {
    const VirtualMachine machine = make_machine(seed, errors);
    for (std::size_t i = 0; i < 6; ++i) {
      squares +=
          (machine.as_built.base_joints_mm[i] - machine.nominal.base_joints_mm[i]).squaredNorm() / (8 * 18);
    }
  }
  EXPECT_NEAR(std::sqrt(squares), 0.1, 0.03);
}

TEST(VirtualMachine, BacklashDependsOnTheWay) {
  MachineErrors errors;
  errors.backlash_mm = 0.05;
  const VirtualMachine machine = make_machine(4, errors);
  const LegVector readings = commanded_readings(machine.nominal, {{5, 5, 5}, {0, 0, 0}});
  const auto from_below = true_pose(machine, readings, readings.array() - 1);
  const auto from_above = true_pose(machine, readings, readings.array() + 1);
  const double play = from_above->position_mm.z() - from_below->position_mm.z();
  EXPECT_GT(play, 0.04);
  EXPECT_LT(play, 0.08);
}

TEST(VirtualMachine, SaysWhenALegLeavesItsStroke) {
  const VirtualMachine machine = make_machine(1, {});
  const LegVector far = LegVector::Constant(900);
  EXPECT_FALSE(true_pose(machine, far, machine.home_readings).has_value());
}

TEST(VirtualMachine, RefusesWhatNoMachineCanBe) {
  const auto refused = [](auto change, const char* words) {
    MachineErrors errors;
    change(errors);
    EXPECT_THAT([&] { (void)make_machine(1, errors); }, ThrowsInputError(words));
  };
  refused([](MachineErrors& e) { e.joint_sigma_mm = -1; }, "joint_sigma_mm is -1, wanted 0 or more");
  refused([](MachineErrors& e) { e.draws = 0; }, "draws is 0, wanted 1 or more");
  refused([](MachineErrors& e) { e.leg_offset_sigma_mm = 1e5; },
          "the machine errors are so large that the hexapod cannot be assembled at home");
}

TEST(VirtualMachine, SaysWhenNoPoseOfTheRangeCanBeReached) {
  VirtualMachine machine = make_machine(1, {});
  for (Actuator& actuator : machine.nominal.actuators) actuator.max_mm = actuator.min_mm;
  EXPECT_EQ(random_targets(machine, 1, 0, 30, 12 * kRadPerDeg).size(), 1U);
  EXPECT_THAT([&] { (void)random_targets(machine, 1, 1, 30, 12 * kRadPerDeg); },
              ThrowsInputError("no reachable poses within +-30 mm and +-12 deg"));
}

}  // namespace
}  // namespace hexcal
