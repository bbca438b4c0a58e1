#include "calibration/plan_poses.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/calibration/virtual_machine.h"
#include "tests/support/error_matchers.h"
#include "tests/support/hexapods.h"

namespace hexcal {
namespace {

double true_error_mm(const std::vector<Pose>& targets, unsigned seed) {
  const PlatformGeometry nominal = surrogate_hexapod();
  const MachineModel truth = as_built(nominal, {}, 100 + seed);
  const IdentifyResult result = identify(nominal, measured(truth, nominal, targets, {0.1, 0.03, seed}));
  double squares = 0;
  const std::vector<Pose> tests = random_poses(50, {}, 5);
  for (const Pose& target : tests) {
    const auto reached = machine_pose(truth, machine_readings(result.machine, target), target);
    squares += reached ? (reached->position_mm - target.position_mm).squaredNorm() : 1e6;
  }
  return squares / static_cast<double>(tests.size());
}

TEST(PlanPoses, TwelvePlannedComeNearThirtyFourRandom) {
  const PlatformGeometry nominal = surrogate_hexapod();
  const std::vector<Pose> candidates = random_poses(300, {}, 1);
  PlanOptions options;
  options.count = 12;
  options.position_sigma_mm = 0.1;
  options.orientation_sigma_deg = 0.03;
  const PosePlan plan = plan_poses(nominal, candidates, {}, options);
  ASSERT_EQ(plan.chosen.size(), 12u);
  std::vector<Pose> planned;
  for (const std::size_t i : plan.chosen) planned.push_back(candidates[i]);
  double planned_squares = 0;
  double random_squares = 0;
  double random_12_squares = 0;
  for (unsigned seed = 0; seed < 8; ++seed) {
    planned_squares += true_error_mm(planned, seed);
    random_squares += true_error_mm(random_poses(34, {}, 50 + seed), seed);
    random_12_squares += true_error_mm(random_poses(12, {}, 50 + seed), seed);
  }
  EXPECT_LE(std::sqrt(planned_squares), 1.4 * std::sqrt(random_squares));
  EXPECT_LE(std::sqrt(planned_squares), 0.8 * std::sqrt(random_12_squares));
  // The prediction falls with every pose and is better than that of unplanned ones.
  for (std::size_t i = 1; i < 12; ++i)
    EXPECT_LE(plan.by_count[i].position_mm, plan.by_count[i - 1].position_mm * (1 + 1e-12));
  EXPECT_LT(plan.by_count.back().position_mm, plan.random_by_count.back().position_mm);
}

TEST(PlanPoses, LoadPathsAreServedBest) {
  const PlatformGeometry nominal = surrogate_hexapod();
  const std::vector<Pose> candidates = random_poses(200, {}, 1);
  std::vector<Pose> tension;
  for (int i = 0; i < 10; ++i) tension.push_back({{0, 0, -2.0 * i}, {0, 0, 0}});
  PlanOptions options;
  options.count = 8;
  const double by_d = plan_poses(nominal, candidates, tension, options).by_count.back().position_mm;
  options.criterion = PlanCriterion::i_optimal;
  const double by_i = plan_poses(nominal, candidates, tension, options).by_count.back().position_mm;
  EXPECT_LT(by_i, by_d);
}

TEST(PlanPoses, RefusesMorePosesThanCandidates) {
  PlanOptions options;
  options.count = 5;
  EXPECT_THAT([&] { (void)plan_poses(surrogate_hexapod(), random_poses(4, {}, 1), {}, options); },
              ThrowsInputError("4 candidate poses"));
}

}  // namespace
}  // namespace hexcal
