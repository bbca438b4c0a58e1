#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "calibration/calibrate.h"
#include "tests/calibration/virtual_machine.h"
#include "tests/support/error_matchers.h"
#include "tests/support/hexapods.h"
#include "tools/io/calibration_record.h"

namespace hexcal {
namespace {

// A stand-in for the paper's machine with hidden errors that bring its error ranges near the paper's.
constexpr TargetBox kTigerBox{20, 20, 12};
constexpr std::size_t kPoses = 34;

MachineModel tiger(unsigned seed) { return as_built_like_the_paper(surrogate_hexapod(), kTigerBox, seed); }

// Errors at targets that were never measured, over those that the true machine reaches by every method.
ErrorStatistics executed(const MachineModel& truth, const std::vector<CorrectedCommand>& commands) {
  std::vector<PosePair> pairs;
  for (const CorrectedCommand& command : commands) {
    if (!command.readings) continue;
    if (const auto reached = machine_pose(truth, *command.readings, command.target))
      pairs.push_back({command.target, *reached});
  }
  return error_statistics(pairs);
}

std::vector<Target> other_targets(std::size_t count) {
  std::vector<Target> targets;
  for (const Pose& pose : random_poses(count, kTigerBox, 4711)) targets.push_back({"t", pose});
  return targets;
}

struct Outcome {
  ErrorStatistics before;
  ErrorStatistics after;
  double position_percent() const {
    return improvement_percent(before.position_rms_mm, after.position_rms_mm);
  }
  double orientation_percent() const {
    return improvement_percent(before.orientation_rms_rad, after.orientation_rms_rad);
  }
};

Outcome compensated(const MachineModel& truth, const Candidate& candidate, const ObservationSet& set) {
  const PlatformGeometry nominal = surrogate_hexapod();
  std::string reason;
  const auto fitted = fit_candidate(nominal, set, candidate, &reason);
  EXPECT_TRUE(fitted) << reason;
  const std::vector<Target> targets = other_targets(200);
  CalibrationModel none;
  none.nominal = nominal;
  return {executed(truth, compensate(none, targets)), executed(truth, compensate(fitted->model, targets))};
}

Candidate kinematic() { return {"kinematic", CompensationMethod::kinematic, {}, 48}; }

TEST(VirtualTiger, HasErrorsOfThePapersSize) {
  double position_mm = 0;
  double orientation_deg = 0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const ErrorStatistics s =
        uncompensated(tiger(seed), surrogate_hexapod(), random_poses(kPoses, kTigerBox, seed));
    EXPECT_EQ(s.poses, kPoses);
    position_mm += s.position_magnitude_mm / 5;
    orientation_deg += s.orientation_magnitude_rad * kDegPerRad / 5;
  }
  RecordProperty("position_magnitude_mm", fmt::format("{}", position_mm));
  RecordProperty("orientation_magnitude_deg", fmt::format("{}", orientation_deg));
  EXPECT_NEAR(position_mm, 19.7, 5);
  EXPECT_NEAR(orientation_deg, 11.1, 2.5);
}

// The paper's improvements: option 1 9.8 % and 19.9 %, option 2 -6.0 % and 21.5 %, option 3 6.9 % and 24.6 %,
// of magnitudes of ranges. Lines in pose space cannot follow errors that couple all six parameters.
TEST(VirtualTiger, InThePapersSituationItsOptionsImproveAsInThePaper) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const MachineModel truth = tiger(seed);
    const ObservationSet set =
        measured(truth, surrogate_hexapod(), random_poses(kPoses, kTigerBox, 20 + seed), {0.425, 0.1, seed});
    double best_position = 0;
    for (const CompensationMethod method :
         {CompensationMethod::option1, CompensationMethod::option2, CompensationMethod::option3}) {
      const Outcome paper = compensated(truth, {"", method, {}, 0}, set);
      const double position =
          improvement_percent(paper.before.position_magnitude_mm, paper.after.position_magnitude_mm);
      const double orientation =
          improvement_percent(paper.before.orientation_magnitude_rad, paper.after.orientation_magnitude_rad);
      EXPECT_GT(position, -25) << name(method);
      EXPECT_LT(position, 45) << name(method);
      EXPECT_GT(orientation, -25) << name(method);
      EXPECT_LT(orientation, 45) << name(method);
      best_position = std::max(best_position, position);
      RecordProperty(fmt::format("machine_{}_{}", seed, name(method)),
                     fmt::format("{:.1f} % {:.1f} %", position, orientation));
    }
    const Outcome ours = compensated(truth, kinematic(), set);
    const double position =
        improvement_percent(ours.before.position_magnitude_mm, ours.after.position_magnitude_mm);
    const double orientation =
        improvement_percent(ours.before.orientation_magnitude_rad, ours.after.orientation_magnitude_rad);
    EXPECT_GT(position, 92);
    EXPECT_GT(orientation, 92);
    RecordProperty(fmt::format("machine_{}_kinematic", seed),
                   fmt::format("{:.1f} % {:.1f} %", position, orientation));
    EXPECT_GT(best_position, 0);
  }
}

TEST(VirtualTiger, ErrorsFallByMoreThan998PerMilleAtImageAccuracy) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const MachineModel truth = tiger(seed);
    const ObservationSet set = measured(truth, surrogate_hexapod(),
                                        random_poses(kPoses, kTigerBox, 10 + seed), {0.004, 0.002, seed});
    const Outcome outcome = compensated(truth, kinematic(), set);
    EXPECT_GE(outcome.position_percent(), 99.8) << "machine " << seed;
    EXPECT_GE(outcome.orientation_percent(), 99.8) << "machine " << seed;
    EXPECT_EQ(outcome.after.poses, 200);
  }
}

TEST(VirtualTiger, ErrorsFallByMoreThan92PercentAtThePapersNoise) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const MachineModel truth = tiger(seed);
    const ObservationSet set =
        measured(truth, surrogate_hexapod(), random_poses(kPoses, kTigerBox, 20 + seed), {0.425, 0.1, seed});
    const Outcome outcome = compensated(truth, kinematic(), set);
    EXPECT_GE(outcome.position_percent(), 92) << "machine " << seed;
    EXPECT_GE(outcome.orientation_percent(), 92) << "machine " << seed;
  }
}

TEST(VirtualTiger, FaultsOutsideTheModelAreNeverWorseThanThePapersOptions) {
  MachineModel truth = tiger(5);
  // Non-linear by 1 % of the stroke in shapes beyond the curves that are fitted, compliance under gravity,
  // and 0.05 mm of backlash.
  for (std::size_t leg = 0; leg < 6; ++leg) {
    const double sign = leg % 2 == 0 ? 1.0 : -1.0;
    truth.stroke_curves[leg] = {330, 630, {1.2 * sign, 0.4, -0.3 * sign, 0.2, 0.15, -0.1, 0.1 * sign, 0.08}};
  }
  truth.sag << 0.15, 4, -3, 5;
  truth.backlash_mm.setConstant(0.05);
  const PlatformGeometry nominal = surrogate_hexapod();
  ObservationSet set = measured(truth, nominal, random_poses(kPoses, kTigerBox, 31), {0.004, 0.002, 6});
  const LegVector home = readings_from_lengths(nominal, leg_lengths(nominal, nominal.home_B_from_P()));
  for (PoseObservation& pose : set.poses) {
    pose.approach = (pose.readings - home).cwiseSign();
    pose.measured = *machine_pose(truth, pose.readings, *pose.target, pose.approach);
    pose.approach.setZero();  // the user does not tell
  }
  CalibrateOptions options;
  options.comparison.leave_one_out_up_to = 0;
  options.comparison.folds = 5;
  const CalibrationReport report = calibrate(nominal, set, options);
  const std::vector<Target> targets = other_targets(200);
  const ErrorStatistics ours = executed(truth, compensate(report.fitted.model, targets));
  for (const CompensationMethod method :
       {CompensationMethod::option1, CompensationMethod::option2, CompensationMethod::option3}) {
    const Outcome paper = compensated(truth, {"", method, {}, 0}, set);
    EXPECT_LE(ours.position_rms_mm, paper.after.position_rms_mm) << name(method);
    EXPECT_LE(ours.orientation_rms_rad, paper.after.orientation_rms_rad) << name(method);
  }
  // The stroke curves are seen and pay: the plain kinematic model is beaten.
  const Outcome plain = compensated(truth, kinematic(), set);
  EXPECT_LT(ours.position_rms_mm, 0.5 * plain.after.position_rms_mm) << report.chosen;
}

TEST(Calibrate, PrefersPlainGeometryWhereNothingElseIsWrong) {
  const MachineModel truth = tiger(2);
  const ObservationSet set =
      measured(truth, surrogate_hexapod(), random_poses(kPoses, kTigerBox, 13), {0.02, 0.005, 3});
  CalibrateOptions options;
  options.comparison.leave_one_out_up_to = 0;
  const CalibrationReport report = calibrate(surrogate_hexapod(), set, options);
  EXPECT_EQ(report.chosen, "kinematic") << report.why;
  ASSERT_TRUE(report.identifiability);
  EXPECT_EQ(report.identifiability->rank, 48);
}

TEST(Calibrate, SmallSetsDegradeGracefully) {
  const MachineModel truth = tiger(2);
  double last = 1e9;
  for (const std::size_t count : {6, 8, 12, 34}) {
    const ObservationSet set =
        measured(truth, surrogate_hexapod(), random_poses(count, kTigerBox, 13), {0.02, 0.005, 3});
    const Outcome outcome = compensated(truth, kinematic(), set);
    EXPECT_GE(outcome.position_percent(), count < 8 ? 50 : count < 12 ? 80 : 95) << count;
    EXPECT_LT(outcome.after.position_rms_mm, 1.2 * last);
    last = outcome.after.position_rms_mm;
  }
}

TEST(Calibrate, LevelPosesHaveRank24AndAreToldSo) {
  const PlatformGeometry nominal = nategh_agheli_hexapod();
  const MachineModel truth = as_built(nominal, {0, 0.5, 0}, 2);
  ObservationSet set = measured(truth, nominal, random_poses(40, {120, 120, 0}, 13), {});
  IdentifyOptions options;
  options.scales = false;
  // Commanded and, with exact joints, reached level: measured so.
  for (PoseObservation& pose : set.poses) {
    pose.measured.rpy_rad.setZero();
    pose.covariance = Vector6d::Constant(1e-4).asDiagonal();
  }
  const IdentifyResult result = identify(nominal, set, options);
  ASSERT_EQ(result.status, IdentifyStatus::identified) << result.reason;
  const Identifiability judged = judge_identifiability(nominal, result);
  EXPECT_EQ(judged.free_parameters, 42);
  EXPECT_EQ(judged.rank, 24);
  EXPECT_NE(judged.advice.find("tilted about x and y"), std::string::npos) << judged.advice;
}

TEST(Calibrate, NamesTheWrongLeg) {
  const PlatformGeometry nominal = surrogate_hexapod();
  MachineModel truth = as_built(nominal, {0.1, 0.1, 0.0005}, 2);
  truth.geometry.actuators[0].mm_per_unit *= 0.94;
  truth.geometry.actuators[0].offset_mm += 0.06 * 480;
  const ObservationSet set = measured(truth, nominal, random_poses(30, kTigerBox, 13), {0.01, 0.003, 3});
  const IdentifyResult result = identify(nominal, set, {});
  const Identifiability judged = judge_identifiability(nominal, result);
  EXPECT_TRUE(judged.legs[0].wrong);
  EXPECT_NE(judged.legs[0].sentence.find("scale -6.0"), std::string::npos) << judged.legs[0].sentence;
  for (std::size_t leg = 1; leg < 6; ++leg) EXPECT_FALSE(judged.legs[leg].wrong) << judged.legs[leg].sentence;
}

TEST(Calibrate, CountsTheTargetsThatACorrectionLoses) {
  PlatformGeometry nominal = surrogate_hexapod();
  const MachineModel truth = tiger(2);
  const ObservationSet set = measured(truth, nominal, random_poses(12, kTigerBox, 13), {0.02, 0.005, 3});
  // Just enough stroke for what was commanded.
  std::vector<Target> targets;
  for (std::size_t k = 0; k < 6; ++k) nominal.actuators[k].max_mm = 0;
  for (const PoseObservation& pose : set.poses) {
    targets.push_back({pose.id, *pose.target});
    const LegVector lengths = lengths_from_readings(nominal, pose.readings);
    for (std::size_t k = 0; k < 6; ++k)
      nominal.actuators[k].max_mm =
          std::max(nominal.actuators[k].max_mm, lengths[static_cast<Eigen::Index>(k)] + 1e-6);
  }
  CalibrateOptions options;
  options.method = "geometry";
  const CalibrationReport report = calibrate(nominal, set, options);
  int lost = 0;
  for (const CorrectedCommand& command : compensate(report.fitted.model, targets))
    lost += command.status == CommandStatus::ok ? 0 : 1;
  EXPECT_GT(lost, 0);
  for (const CrossValidation& method : report.comparison.methods) {
    if (method.name == "kinematic") {
      EXPECT_EQ(method.targets_lost, lost);
    } else if (method.name == "none") {
      EXPECT_EQ(method.targets_lost, 0);
    }
  }
}

TEST(Calibrate, ThreadsChangeNothing) {
  const MachineModel truth = tiger(2);
  const ObservationSet set =
      measured(truth, surrogate_hexapod(), random_poses(12, kTigerBox, 13), {0.02, 0.005, 3});
  std::vector<std::string> records;
  for (const std::size_t threads : {1, 4}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    records.push_back(calibration_record_text("key", calibrate(surrogate_hexapod(), set, {})));
  }
  EXPECT_EQ(records[0], records[1]);
}

TEST(Calibrate, RefusesTooFewPoses) {
  const MachineModel truth = tiger(2);
  const ObservationSet set =
      measured(truth, surrogate_hexapod(), random_poses(3, kTigerBox, 13), {0.02, 0.005, 3});
  EXPECT_THAT([&] { (void)calibrate(surrogate_hexapod(), set); }, ThrowsInputError("3 measured poses"));
}

}  // namespace
}  // namespace hexcal
