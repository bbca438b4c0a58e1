#include <ceres/ceres.h>
#include <gmock/gmock.h>

#include <Eigen/Cholesky>
#include <memory>

#include "photogrammetry/adjustment/adjustment.h"
#include "tests/support/observation_scene.h"
#include "tests/support/scene_errors.h"

// The same problem in two hands: built for ceres::Solver with derivatives by differences and a projection
// written here, and adjusted by hexcal.

namespace hexcal {
namespace {

// One square in one photograph. Blocks: camera parameters, print scale, station, body pose, feature pose; the
// motions as perturbations (covariance.h) of where hexcal has them.
struct SquareResidual {
  const ObservationScene* scene;
  const NetworkGeometry* at;
  std::size_t photo, feature;
  Eigen::Matrix<double, 8, 1> px;
  double sigma_px;

  bool operator()(const double* camera, const double* scale, const double* station, const double* pose,
                  const double* own, double* residuals) const {
    const auto motion = [](const Rigid3& from, const double* delta) {
      return perturbed(from, Eigen::Map<const Vector6d>(delta));
    };
    CameraModel model = scene->network.cameras[0].model;
    model.parameters = Eigen::Map<const Eigen::VectorXd>(camera, model.parameters.size());
    const NetworkFeature& square = scene->network.features[feature];
    Rigid3 camera_from_body = motion(at->camera_from_reference[photo], station);
    if (square.body != kReferenceBody) {
      const auto epoch = static_cast<std::size_t>(scene->network.photos[photo].epoch);
      camera_from_body = camera_from_body * motion(at->reference_from_body[kMovingBody][epoch], pose);
    }
    const Rigid3 camera_from_square = camera_from_body * motion(at->body_from_feature[feature], own);
    for (int c = 0; c < 4; ++c) {
      const Eigen::Vector3d x = camera_from_square * Eigen::Vector3d((1 + scale[0]) * square.drawn_mm.col(c));
      const Eigen::Vector2d image = model.image_from_normalised(x.head<2>() / x.z());
      Eigen::Map<Eigen::Vector2d>(residuals + 2 * c) = (image - px.segment<2>(2 * c)) / sigma_px;
    }
    return true;
  }
};

// Rows times the difference of a block from its mean.
struct PriorResidual {
  Eigen::MatrixXd root;
  Eigen::VectorXd mean;
  bool operator()(double const* const* blocks, double* residuals) const {
    Eigen::Map<Eigen::VectorXd>(residuals, root.rows()) =
        root * (Eigen::Map<const Eigen::VectorXd>(blocks[0], mean.size()) - mean);
    return true;
  }
};

TEST(AdjustmentCeres, TheSameProblemHasTheSameSolutionAndCovariance) {
  constexpr double kScaleSigma = 0.002;
  ObservationSceneOptions options;
  options.num_epochs = 3;
  options.markers_per_body = 5;
  options.noise_px = 0.01;
  options.interior_sigma = 1;
  const ObservationScene scene = make_observation_scene(options);
  AdjustmentOptions adjust;
  adjust.shape = AdjustmentOptions::Shape::rigid;
  adjust.print_scale_sigma = kScaleSigma;
  const AdjustmentResult result = adjust_network(scene.network, adjust);
  ASSERT_EQ(result.status, AdjustmentStatus::ok) << result.reason;
  const NetworkGeometry& at = result.geometry;

  // A start beside the solution.
  std::mt19937_64 rng(9);
  std::normal_distribution<double> normal(0.0, 1.0);
  const auto beside = [&](std::size_t count) {
    std::vector<Vector6d> deltas(count);
    for (Vector6d& delta : deltas) {
      for (int i = 0; i < 6; ++i) delta[i] = (i < 3 ? 0.05 : 2e-4) * normal(rng);
    }
    return deltas;
  };
  std::vector<Vector6d> stations = beside(scene.network.photos.size());
  std::vector<Vector6d> poses = beside(static_cast<std::size_t>(scene.network.num_epochs));
  std::vector<Vector6d> features = beside(scene.network.features.size());
  Eigen::VectorXd camera = scene.network.cameras[0].model.parameters;
  double scale = 0.001;
  ceres::Problem problem;
  for (const Sighting& sighting : result.sightings) {
    ASSERT_EQ(sighting.status, SightingStatus::used);
    const auto p = static_cast<std::size_t>(sighting.photo);
    const auto f = static_cast<std::size_t>(sighting.feature);
    // The whitener has a floor of 1e-10 px^2 on the diagonal (sighting.cc).
    const double sigma_px = std::sqrt(options.noise_px * options.noise_px + 1e-10) * result.sigma0;
    problem.AddResidualBlock(
        new ceres::NumericDiffCostFunction<SquareResidual, ceres::RIDDERS, 8, 9, 1, 6, 6, 6>(
            new SquareResidual{&scene, &at, p, f, sighting.px, sigma_px}),
        nullptr, camera.data(), &scale, stations[p].data(),
        poses[static_cast<std::size_t>(scene.network.photos[p].epoch)].data(), features[f].data());
  }
  const auto add_prior = [&](const Eigen::MatrixXd& root, const Eigen::VectorXd& mean, double* block) {
    auto* cost = new ceres::DynamicNumericDiffCostFunction<PriorResidual, ceres::CENTRAL>(
        new PriorResidual{root, mean});
    cost->AddParameterBlock(static_cast<int>(mean.size()));
    cost->SetNumResiduals(static_cast<int>(root.rows()));
    problem.AddResidualBlock(cost, nullptr, block);
  };
  const Eigen::MatrixXd root = scene.network.cameras[0].covariance.llt().matrixL();
  add_prior(root.inverse(), scene.network.cameras[0].model.parameters, camera.data());
  add_prior(Eigen::MatrixXd::Constant(1, 1, 1 / kScaleSigma), Eigen::VectorXd::Zero(1), &scale);
  // The square that holds its body's frame: hexcal knows it exactly.
  for (std::size_t f = 0; f < features.size(); ++f) {
    if (result.body_from_feature(static_cast<int>(f)).by_error.norm() > 0) continue;
    features[f].setZero();
    problem.SetParameterBlockConstant(features[f].data());
  }
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_QR;
  solver.function_tolerance = 1e-20;
  solver.gradient_tolerance = 1e-20;
  solver.parameter_tolerance = 1e-16;
  solver.max_num_iterations = 30;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  ASSERT_TRUE(summary.IsSolutionUsable()) << summary.BriefReport();

  // Projections by both.
  double largest_px = 0;
  for (const Sighting& sighting : result.sightings) {
    const auto p = static_cast<std::size_t>(sighting.photo);
    const auto f = static_cast<std::size_t>(sighting.feature);
    const auto e = static_cast<std::size_t>(scene.network.photos[p].epoch);
    Vector8d ours;
    ASSERT_TRUE(residual_px(scene.network, at, sighting, ours, nullptr));
    Vector8d theirs;
    SquareResidual{&scene, &at, p, f, sighting.px, 1.0}(camera.data(), &scale, stations[p].data(),
                                                        poses[e].data(), features[f].data(), theirs.data());
    largest_px = std::max(largest_px, (ours + theirs).cwiseAbs().maxCoeff());
  }
  EXPECT_LT(largest_px, 1e-9);

  ceres::Covariance::Options how;
  how.algorithm_type = ceres::DENSE_SVD;
  how.null_space_rank = -1;
  ceres::Covariance covariance(how);
  std::vector<std::pair<const double*, const double*>> blocks;
  for (const Vector6d& pose : poses) blocks.emplace_back(pose.data(), pose.data());
  blocks.emplace_back(poses[0].data(), poses[2].data());
  blocks.emplace_back(stations[4].data(), stations[4].data());
  ASSERT_TRUE(covariance.Compute(blocks, &problem));
  using RowMajor = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
  const auto expect_same = [&](const Vector6d& a, const Vector6d& b, const Matrix6d& ours) {
    RowMajor theirs;
    ASSERT_TRUE(covariance.GetCovarianceBlock(a.data(), b.data(), theirs.data()));
    const Vector6d unit = ours.diagonal().cwiseAbs().cwiseSqrt().cwiseInverse();
    const Matrix6d difference = unit.asDiagonal() * (Matrix6d(theirs) - ours) * unit.asDiagonal();
    EXPECT_LT(difference.cwiseAbs().maxCoeff(), 0.01) << ours << "\n\n" << theirs;
  };
  for (int e = 0; e < 3; ++e)
    expect_same(poses[static_cast<std::size_t>(e)], poses[static_cast<std::size_t>(e)],
                result.pose_covariance(e, e));
  expect_same(stations[4], stations[4], result.camera_from_reference(4).covariance());
  RowMajor cross;
  ASSERT_TRUE(covariance.GetCovarianceBlock(poses[0].data(), poses[2].data(), cross.data()));
  EXPECT_LT((Matrix6d(cross) - result.pose_covariance(0, 2)).norm(), 0.01 * cross.norm());
  EXPECT_NEAR(scale, result.print_scale()->value, 1e-9);
}

}  // namespace
}  // namespace hexcal
