#include "calibration/statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "calibration/unmeasured.h"
#include "tests/support/hexapods.h"
#include "tests/support/rigid_matchers.h"

namespace hexcal {
namespace {

Vector6d mm_and_deg(double x, double y, double z, double roll, double pitch, double yaw) {
  Vector6d v;
  v << x, y, z, roll * kRadPerDeg, pitch * kRadPerDeg, yaw * kRadPerDeg;
  return v;
}

// Two poses whose errors span the ranges exactly.
std::vector<PosePair> pairs_with_ranges(const Vector6d& range) {
  const Pose a{{3, -4, 20}, {0.05, -0.1, 0.2}};
  const Pose b{{-30, 12, 5}, {0.01, 0.02, -0.03}};
  return {{a, Pose::from_vector(a.vector() + 0.25 * range)},
          {b, Pose::from_vector(b.vector() - 0.75 * range)}};
}

struct PaperTable {
  Vector6d range;
  double position_magnitude;
  double orientation_magnitude;
  double position_improvement;
  double orientation_improvement;
};

// Tables 2, 3 and 4 of Karmakar and Turner: ranges, magnitudes by eq. 7, improvements, as printed there.
const Vector6d kUncompensated = mm_and_deg(26.54, 16.67, 13.49, 8.27, 11.99, 12.59);
const std::vector<PaperTable> kPaperTables{
    {mm_and_deg(20.25, 18.44, 14.01, 6.86, 10.29, 9.2), 17.76, 8.90, 9.8, 19.9},
    {mm_and_deg(25.20, 20.31, 16.14, 6.05, 11.32, 7.99), 20.88, 8.73, -6.0, 21.5},
    {mm_and_deg(26.92, 13.74, 9.81, 6.01, 10.39, 8.18), 18.35, 8.39, 6.9, 24.6},
};

TEST(Statistics, ReproducesTheMagnitudesAndImprovementsOfThePaper) {
  const ErrorStatistics before = error_statistics(pairs_with_ranges(kUncompensated));
  EXPECT_NEAR(before.position_magnitude_mm, 19.70, 0.005);
  EXPECT_NEAR(before.orientation_magnitude_rad * kDegPerRad, 11.12, 0.005);
  for (const PaperTable& table : kPaperTables) {
    const ErrorStatistics after = error_statistics(pairs_with_ranges(table.range));
    EXPECT_THAT(after.range, MatrixNear(table.range, 1e-12));
    EXPECT_NEAR(after.position_magnitude_mm, table.position_magnitude, 0.0051);
    EXPECT_NEAR(after.orientation_magnitude_rad * kDegPerRad, table.orientation_magnitude, 0.0051);
    EXPECT_NEAR(improvement_percent(before.position_magnitude_mm, after.position_magnitude_mm),
                table.position_improvement, 0.051);
    EXPECT_NEAR(improvement_percent(before.orientation_magnitude_rad, after.orientation_magnitude_rad),
                table.orientation_improvement, 0.051);
  }
}

TEST(Statistics, RmsIsOfDistanceAndOfRotationAngle) {
  // Yaw of target and actual straddle +-180 deg: 2 deg apart, not 358.
  const std::vector<PosePair> pairs{
      {{{0, 0, 0}, {0, 0, 179 * kRadPerDeg}}, {{3, 4, 0}, {0, 0, -179 * kRadPerDeg}}},
      {{{0, 0, 0}, {0, 0, 0}}, {{0, 0, 0}, {0, 0, 0}}},
  };
  const ErrorStatistics s = error_statistics(pairs);
  EXPECT_NEAR(s.position_rms_mm, 5 / std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(s.position_max_mm, 5, 1e-12);
  EXPECT_NEAR(s.orientation_rms_rad * kDegPerRad, 2 / std::sqrt(2.0), 1e-10);
  EXPECT_NEAR(s.mean[5] * kDegPerRad, 1, 1e-10);
  EXPECT_NEAR(s.rms[0], 3 / std::sqrt(2.0), 1e-12);
}

TEST(Statistics, ConstantErrorHasNoRangeButAnRms) {
  std::vector<PosePair> pairs;
  for (double x : {-10.0, 0.0, 10.0}) pairs.push_back({{{x, 0, 0}, {0, 0, 0}}, {{x + 7, 0, 0}, {0, 0, 0}}});
  const ErrorStatistics s = error_statistics(pairs);
  EXPECT_NEAR(s.position_magnitude_mm, 0, 1e-12);
  EXPECT_NEAR(s.position_rms_mm, 7, 1e-12);
}

TEST(Statistics, OfNothingIsZero) {
  EXPECT_EQ(error_statistics({}).poses, 0);
  EXPECT_EQ(improvement_percent(0, 1), 0);
}

// With z alone measured, what is not measured is no number, never zero.
TEST(Unmeasured, CoordinatesAreEmptyAndNeverZero) {
  MethodComparison comparison;
  comparison.methods.resize(1);
  comparison.fitted.resize(1);
  ObservationSet observations;
  PoseObservation pose;
  pose.observed = {false, false, true, false, false, false};
  observations.poses = {pose, pose};
  CrossValidation& method = comparison.methods[0];
  method.name = "none";
  method.held_out.resize(2);
  method.held_out[1].actual.position_mm.z() = 0.5;
  method.held_out_index = {0, 1};
  method.errors = error_statistics(method.held_out);
  count_unmeasured(surrogate_hexapod(), observations, false, comparison);
  EXPECT_TRUE(std::isnan(method.errors.position_rms_mm));
  EXPECT_TRUE(std::isnan(method.errors.orientation_rms_rad));
  EXPECT_TRUE(std::isnan(method.errors.rms[0]));
  EXPECT_DOUBLE_EQ(method.errors.range[2], 0.5);
  EXPECT_FALSE(method.predicted.has_value());
}

}  // namespace
}  // namespace hexcal
