#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "calibration/calibrate.h"
#include "calibration/identify.h"
#include "kinematics/geometry/input_error.h"
#include "tests/calibration/virtual_machine.h"
#include "tests/support/hexapods.h"

// Campaigns as no machine gives them: a name for what is wrong, or finite numbers.

namespace hexcal {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Torture {
  const char* name;
  std::function<void(ObservationSet&)> spoil;
};

ObservationSet campaign(std::size_t poses) {
  const PlatformGeometry nominal = surrogate_hexapod();
  return measured(as_built(nominal, {}, 3), nominal, random_poses(poses, {}, 9), {0.01, 0.005, 4});
}

void each(ObservationSet& set, const std::function<void(PoseObservation&)>& change) {
  for (PoseObservation& pose : set.poses) change(pose);
}

const std::vector<Torture>& tortures() {
  static const std::vector<Torture> all{
      {"EveryPoseTheSame",
       [](ObservationSet& s) {
         each(s, [first = s.poses[0]](PoseObservation& p) {
           const std::string id = p.id;
           p = first;
           p.id = id;
         });
       }},
      {"TwoPosesManyTimes",
       [](ObservationSet& s) {
         for (std::size_t i = 2; i < s.poses.size(); ++i) {
           const std::string id = s.poses[i].id;
           s.poses[i] = s.poses[i % 2];
           s.poses[i].id = id;
         }
       }},
      {"ReadingsThatNeverChange",
       [](ObservationSet& s) {
         each(s, [first = s.poses[0].readings](PoseObservation& p) { p.readings = first; });
       }},
      {"MeasuredInMetres",
       [](ObservationSet& s) { each(s, [](PoseObservation& p) { p.measured.position_mm /= 1000; }); }},
      {"MeasuredInMicrometres",
       [](ObservationSet& s) { each(s, [](PoseObservation& p) { p.measured.position_mm *= 1000; }); }},
      {"AnglesInDegrees",
       [](ObservationSet& s) { each(s, [](PoseObservation& p) { p.measured.rpy_rad *= kDegPerRad; }); }},
      {"ReadingsInMetres",
       [](ObservationSet& s) { each(s, [](PoseObservation& p) { p.readings /= 1000; }); }},
      {"ReadingsInMicrometres",
       [](ObservationSet& s) { each(s, [](PoseObservation& p) { p.readings *= 1000; }); }},
      {"NanMeasured", [](ObservationSet& s) { s.poses[2].measured.position_mm.y() = kNan; }},
      {"NanReading", [](ObservationSet& s) { s.poses[2].readings[4] = kNan; }},
      {"NanCovariance", [](ObservationSet& s) { s.poses[2].covariance(1, 1) = kNan; }},
      {"ZeroCovariance", [](ObservationSet& s) { each(s, [](auto& p) { p.covariance.setZero(); }); }},
      {"TinyCovariance", [](ObservationSet& s) { each(s, [](auto& p) { p.covariance *= 1e-18; }); }},
      {"HugeCovariance", [](ObservationSet& s) { each(s, [](auto& p) { p.covariance *= 1e18; }); }},
      {"HugeReading", [](ObservationSet& s) { s.poses[2].readings[0] = 1e12; }},
      {"OnlyUpAndDown",
       [](ObservationSet& s) {
         const PlatformGeometry nominal = surrogate_hexapod();
         std::vector<Pose> line;
         for (int i = 0; i < 12; ++i) line.push_back(Pose{{0, 0, 2.0 * i - 12}, {0, 0, 0}});
         s = measured(as_built(nominal, {}, 3), nominal, line, {0.01, 0.005, 4});
       }},
      {"NoPose", [](ObservationSet& s) { s.poses.clear(); }},
      {"OnePose", [](ObservationSet& s) { s.poses.resize(1); }},
      {"TwoPoses", [](ObservationSet& s) { s.poses.resize(2); }},
      {"SevenPoses", [](ObservationSet& s) { s.poses.resize(7); }},
  };
  return all;
}

class CalibrationTorture : public ::testing::TestWithParam<std::size_t> {};

void expect_finite(const MachineModel& machine) {
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_TRUE(machine.geometry.base_joints_mm[i].allFinite());
    EXPECT_TRUE(machine.geometry.platform_joints_mm[i].allFinite());
    EXPECT_TRUE(std::isfinite(machine.geometry.actuators[i].offset_mm));
    EXPECT_TRUE(std::isfinite(machine.geometry.actuators[i].mm_per_unit));
  }
}

TEST_P(CalibrationTorture, IdentifyHasAReasonOrFiniteNumbers) {
  ObservationSet set = campaign(16);
  tortures()[GetParam()].spoil(set);
  try {
    const IdentifyResult result = identify(surrogate_hexapod(), set);
    if (result.status == IdentifyStatus::failed) {
      EXPECT_NE(result.reason, "");
      EXPECT_NE(result.reason, "not called");
      return;
    }
    expect_finite(result.machine);
    EXPECT_TRUE(result.corrections.allFinite());
    EXPECT_TRUE(result.covariance.allFinite());
    EXPECT_GE(result.covariance.diagonal().minCoeff(), 0);
    EXPECT_TRUE(std::isfinite(result.sigma0));
    EXPECT_TRUE(std::isfinite(result.leg_sigma_mm));
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()), "");
  }
}

TEST_P(CalibrationTorture, CalibrateHasAReasonOrFiniteNumbers) {
  ObservationSet set = campaign(12);
  tortures()[GetParam()].spoil(set);
  CalibrateOptions options;
  options.method = "geometry";
  try {
    const CalibrationReport report = calibrate(surrogate_hexapod(), set, options);
    EXPECT_NE(report.chosen, "");
    if (report.uncompensated) {
      EXPECT_TRUE(report.uncompensated->rms.allFinite());
    }
    for (const CrossValidation& method : report.comparison.methods) {
      if (!method.failure.empty()) continue;
      EXPECT_TRUE(std::isfinite(method.errors.position_rms_mm)) << method.name;
      EXPECT_TRUE(std::isfinite(method.errors.orientation_rms_rad)) << method.name;
    }
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()), "");
  }
}

INSTANTIATE_TEST_SUITE_P(Of, CalibrationTorture, ::testing::Range(std::size_t{0}, tortures().size()),
                         [](const auto& torture) { return std::string(tortures()[torture.param].name); });

}  // namespace
}  // namespace hexcal
