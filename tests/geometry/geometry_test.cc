#include <gtest/gtest.h>

#include <random>

#include "kinematics/geometry/covariance.h"
#include "kinematics/geometry/pose.h"
#include "kinematics/geometry/pose_pole.h"
#include "kinematics/geometry/rigid3.h"
#include "tests/support/rigid_matchers.h"

namespace hexcal {
namespace {

class Geometry : public ::testing::Test {
 protected:
  Rigid3 random_motion() {
    std::normal_distribution<double> normal;
    Eigen::Quaterniond q(normal(rng_), normal(rng_), normal(rng_), normal(rng_));
    return {q, Eigen::Vector3d(100 * normal(rng_), 100 * normal(rng_), 100 * normal(rng_))};
  }
  std::mt19937_64 rng_{1};
};

template <typename Function>
Matrix6d numeric_jacobian(const Function& f) {
  const double h = 1e-6;
  Matrix6d j;
  for (int i = 0; i < 6; ++i) {
    Vector6d delta = Vector6d::Zero();
    delta[i] = h;
    j.col(i) = (f(delta) - f(-delta)) / (2 * h);
  }
  return j;
}

TEST_F(Geometry, InverseTimesItselfIsIdentity) {
  for (int i = 0; i < 100; ++i) {
    const Rigid3 t = random_motion();
    EXPECT_THAT(t * inverse(t), RigidNear(Rigid3(), 1e-12, 1e-12));
  }
}

TEST_F(Geometry, RotationVectorRoundTrip) {
  for (double scale : {0.0, 1e-14, 1e-9, 1e-5, 1e-4, 0.1, 3.0}) {
    const Eigen::Vector3d v = scale * Eigen::Vector3d(1, -2, 2) / 3.0;
    const Eigen::Vector3d back = rotation_vector_from_quaternion(quaternion_from_rotation_vector(v));
    EXPECT_LE((back - v).norm(), 1e-15 + 1e-14 * scale) << "scale " << scale;
  }
}

TEST_F(Geometry, RpyFollowsTheConvention) {
  // A yaw of 90 deg takes x to y; then pitch about the turned y axis.
  const Eigen::Quaterniond q = quaternion_from_rpy({0, 0, 90 * kRadPerDeg});
  EXPECT_LE((q * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-15);
  const Eigen::Vector3d rpy(0.3, -0.7, 2.5);
  EXPECT_LE((rpy_from_quaternion(quaternion_from_rpy(rpy)) - rpy).norm(), 1e-14);
  const Eigen::Quaterniond gimbal = quaternion_from_rpy({0.2, 90 * kRadPerDeg, 0.5});
  EXPECT_LE(rotation_distance(quaternion_from_rpy(rpy_from_quaternion(gimbal)), gimbal), 1e-7);
}

TEST_F(Geometry, HomeIsGdBelowTheUpperGrip) {
  const Rigid3 ug_from_home = ug_from_lg(Pose{}, 50.0);
  EXPECT_EQ(ug_from_home.translation, Eigen::Vector3d(0, 0, -50));
  const Pose pose{{1, 2, 3}, {0.1, 0.2, 0.3}};
  EXPECT_LE((pose_from_ug_from_lg(ug_from_lg(pose, 50.0), 50.0).vector() - pose.vector()).norm(), 1e-13);
}

TEST_F(Geometry, PoseErrorWraps) {
  const Pose a{{0, 0, 0}, {0, 0, 179 * kRadPerDeg}};
  const Pose b{{0, 0, 0}, {0, 0, -179 * kRadPerDeg}};
  EXPECT_NEAR(pose_error(a, b)[5] * kDegPerRad, -2.0, 1e-12);
}

// Pitch 180 deg is computed as roll and yaw of 180 deg, 270 deg as -90 deg; the error is that of the
// rotation.
TEST_F(Geometry, PoseErrorIsSmallForEveryNameOfARotation) {
  for (const double pitch : {-269.0, -180.0, -100.0, -89.0, 0.0, 60.0, 91.0, 135.0, 180.0, 269.0}) {
    const Pose target{{1, 2, 3}, {0.3, pitch * kRadPerDeg, -0.8}};
    const Vector6d off = (Vector6d() << 0.1, 0.2, -0.1, 1e-3, -2e-3, 1.5e-3).finished();
    const Pose actual = pose_from_home_from_lg(home_from_lg(Pose::from_vector(target.vector() + off)));
    EXPECT_LE((pose_error(actual, target) - off).norm(), 1e-12) << pitch;
  }
}

TEST_F(Geometry, NearThePoleOfPitchTheJacobianIsFiniteAndSaysThatRollAndYawAreNotKnown) {
  Matrix6d motion = Matrix6d::Identity();
  motion.bottomRightCorner<3, 3>() *= 1e-10;  // 2 arc seconds
  for (const double degrees : {90.0, -90.0, 89.99999, 89.5, 80.0}) {
    const Pose pose{{0, 0, 0}, {0.2, degrees * kRadPerDeg, 0.5}};
    const Matrix6d j = pose_parameters_jacobian(pose);
    ASSERT_TRUE(j.allFinite()) << degrees;
    const Matrix6d covariance = j * motion * j.transpose();
    EXPECT_EQ(roll_and_yaw_are_known(pose, covariance), std::abs(degrees) < 89.9) << degrees;
    EXPECT_NEAR(covariance(4, 4), 1e-10, 1e-20);
    const double sign = degrees > 0 ? -1 : 1;  // yaw - roll at +90 deg
    const double together = covariance(5, 5) + covariance(3, 3) + 2 * sign * covariance(3, 5);
    if (std::abs(degrees) < 89.9) {
      EXPECT_NEAR(together, 1e-10, 0.2e-10) << degrees;
    }
  }
}

TEST_F(Geometry, CovarianceJacobiansMatchDifferences) {
  for (int i = 0; i < 20; ++i) {
    const Rigid3 c_from_b = random_motion();
    const Rigid3 b_from_a = random_motion();
    const Rigid3 c_from_a = c_from_b * b_from_a;
    EXPECT_THAT(product_jacobian_left(c_from_b, b_from_a),
                MatrixNear(numeric_jacobian([&](const Vector6d& d) {
                             return perturbation_between(c_from_a, perturbed(c_from_b, d) * b_from_a);
                           }),
                           1e-6));
    EXPECT_THAT(product_jacobian_right(c_from_b, b_from_a),
                MatrixNear(numeric_jacobian([&](const Vector6d& d) {
                             return perturbation_between(c_from_a, c_from_b * perturbed(b_from_a, d));
                           }),
                           1e-6));
    EXPECT_THAT(inverse_jacobian(b_from_a),
                MatrixNear(numeric_jacobian([&](const Vector6d& d) {
                             return perturbation_between(inverse(b_from_a), inverse(perturbed(b_from_a, d)));
                           }),
                           1e-6));
  }
  const Pose pose{{5, -4, 3}, {0.2, -0.4, 0.9}};
  EXPECT_THAT(pose_parameters_jacobian(pose),
              MatrixNear(numeric_jacobian([&](const Vector6d& d) {
                           return pose_from_home_from_lg(perturbed(home_from_lg(pose), d)).vector();
                         }),
                         1e-8));
}

}  // namespace
}  // namespace hexcal
