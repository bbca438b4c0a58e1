#include "photogrammetry/adjustment/outlier_test.h"

#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace hexcal {
namespace {

constexpr double kUnchecked = 1e-3;  // redundancy below which a direction counts as unchecked

// How an own station (if there is one) and the poses of its epoch follow the common parameters, P = [station;
// poses].by_common: P C with all common parameters, and P C P^T. Every sighting of the photograph takes its
// share from these.
struct FollowedCommon {
  Eigen::MatrixXd with_all;
  Eigen::MatrixXd own;
};

FollowedCommon followed_common(const EpochElimination& epoch, const StationElimination* station,
                               const Eigen::MatrixXd& rows) {
  const Eigen::Index of_station = station != nullptr ? 6 : 0;
  const auto width = static_cast<Eigen::Index>(epoch.columns.size());
  Eigen::MatrixXd p(of_station + epoch.by_common.rows(), width);
  if (station != nullptr) p.topRows<6>() = station->by_common;
  if (!epoch.bodies.empty()) p.bottomRows(epoch.by_common.rows()) = epoch.by_common;
  FollowedCommon followed;
  followed.with_all.noalias() = p * rows;
  Eigen::MatrixXd touched(p.rows(), width);
  for (Eigen::Index i = 0; i < width; ++i) {
    touched.col(i) = followed.with_all.col(epoch.columns[static_cast<std::size_t>(i)]);
  }
  followed.own.noalias() = touched * p.transpose();
  return followed;
}

// Covariance of a sighting's prediction (whitened, before the variance factor), by what the station and the
// poses add of their own and by the common parameters; see StationElimination.
struct PredictedCovariance {
  Matrix8d own, common;
};

PredictedCovariance predicted_covariance(const EpochElimination& epoch, const StationElimination* station,
                                         const FeatureJacobian& jacobian, Eigen::Index pose_row,
                                         const CommonJacobian& common, const FollowedCommon& followed,
                                         const Eigen::MatrixXd& covariance) {
  const auto of_poses = 6 * static_cast<Eigen::Index>(epoch.bodies.size());
  const Eigen::Index of_station = station != nullptr ? 6 : 0;
  Eigen::Matrix<double, 8, Eigen::Dynamic> a(8, of_station + of_poses);
  auto by_poses = a.rightCols(of_poses);
  by_poses.setZero();
  if (pose_row >= 0) by_poses.middleCols<6>(pose_row) = -jacobian.pose;
  if (station != nullptr) {
    a.leftCols<6>() = -jacobian.station;
    if (of_poses > 0) by_poses.noalias() += jacobian.station * station->by_poses;
  }
  const Eigen::Index n = common.values.cols();
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic> with_own(a.cols(), n);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, CommonJacobian::kMax, CommonJacobian::kMax> own(n,
                                                                                                           n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const int cj = common.column[static_cast<std::size_t>(j)];
    with_own.col(j) = followed.with_all.col(cj);
    for (Eigen::Index i = 0; i < n; ++i)
      own(i, j) = covariance(common.column[static_cast<std::size_t>(i)], cj);
  }
  const Matrix8d crossed = a * (with_own * common.values.transpose());
  PredictedCovariance predicted;
  predicted.common = a * followed.own * a.transpose() + crossed + crossed.transpose() +
                     common.values * own * common.values.transpose();
  predicted.own.setZero();
  if (station != nullptr) predicted.own += jacobian.station * station->inverse * jacobian.station.transpose();
  if (of_poses > 0) predicted.own += by_poses * epoch.inverse * by_poses.transpose();
  return predicted;
}

}  // namespace

std::vector<SightingTest> test_sightings(const Network& network, const NetworkGeometry& geometry,
                                         const std::vector<Sighting>& sightings, const BundleLayout& layout,
                                         const BundleSettings& settings, const BundleSystem& system,
                                         const Eigen::MatrixXd& covariance) {
  std::vector<SightingTest> tests(sightings.size());
  std::vector<std::vector<std::size_t>> members(system.epochs.size());
  for (std::size_t s = 0; s < sightings.size(); ++s) {
    const auto p = static_cast<std::size_t>(sightings[s].photo);
    const bool testable =
        sightings[s].status == SightingStatus::used || sightings[s].status == SightingStatus::outlier;
    if (testable) members[static_cast<std::size_t>(network.photos[p].epoch)].push_back(s);
  }
  tbb::parallel_for(std::size_t{0}, system.epochs.size(), [&](std::size_t e) {
    if (members[e].empty()) return;
    const EpochElimination& epoch = system.epochs[e];
    const Eigen::MatrixXd rows = covariance(epoch.columns, Eigen::all);
    int photo = -1;
    const StationElimination* station = nullptr;
    FollowedCommon followed;
    FeatureJacobian jacobian;
    jacobian.with_shape = layout.free_shape;
    CommonJacobian common;
    Vector8d r;
    for (const std::size_t s : members[e]) {
      const Sighting& sighting = sightings[s];
      const bool own_station = has_own_station(network, sighting.photo);
      if (photo != sighting.photo) {
        photo = sighting.photo;
        station = own_station ? epoch.station_of(photo) : nullptr;
        if (!own_station || station != nullptr) followed = followed_common(epoch, station, rows);
      }
      const int body = network.features[static_cast<std::size_t>(sighting.feature)].body;
      const int pose_row = body == kReferenceBody ? -1 : epoch.row_of(body);
      tests[s].statistic = std::numeric_limits<double>::infinity();
      if (own_station && station == nullptr) continue;
      if (body != kReferenceBody && pose_row < 0) continue;
      if (!geometry.has_photo[static_cast<std::size_t>(photo)]) continue;
      if (!whitened_residual(network, geometry, sighting, r, &jacobian)) continue;
      common_jacobian(network, layout, sighting, jacobian, common);
      PredictedCovariance predicted =
          predicted_covariance(epoch, station, jacobian, pose_row, common, followed, covariance);
      predicted.own /= settings.data_variance;
      predicted.common /= settings.data_variance;
      // What a sighting helped to estimate follows its error; what it had no part in adds its own.
      const bool used = sighting.status == SightingStatus::used;
      const bool helped_common = used && settings.common_moves;
      const int n = sighting.rows;
      Matrix8d misfit = Matrix8d::Identity() + (used ? -1.0 : 1.0) * predicted.own;
      misfit += (helped_common ? -1.0 : 1.0) * predicted.common;
      const Eigen::MatrixXd q = misfit.topLeftCorner(n, n);
      if (used) {
        Matrix8d helped = predicted.own;
        if (helped_common) helped += predicted.common;
        tests[s].redundancy = 1 - helped.topLeftCorner(n, n).trace() / n;
      }
      const Eigen::VectorXd rn = r.head(n) / std::sqrt(settings.data_variance);
      const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(q);
      const Eigen::VectorXd along = eigen.eigenvectors().transpose() * rn;
      tests[s].statistic = 0;
      for (int i = 0; i < n; ++i) {
        // Directions that nothing else checks cannot show an outlier.
        if (eigen.eigenvalues()[i] > kUnchecked)
          tests[s].statistic += along[i] * along[i] / eigen.eigenvalues()[i];
      }
    }
  });
  return tests;
}

}  // namespace hexcal
