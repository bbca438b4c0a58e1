#include "photogrammetry/adjustment/outlier_test.h"

#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace hexcal {
namespace {

constexpr double kUnchecked = 1e-3;  // redundancy below which a direction counts as unchecked

// Upper quantile of the normal distribution (Abramowitz and Stegun 26.2.23, error below 4.5e-4).
double normal_quantile(double exceeded) {
  const double t = std::sqrt(-2 * std::log(exceeded));
  return t - (2.515517 + 0.802853 * t + 0.010328 * t * t) /
                 (1 + 1.432788 * t + 0.189269 * t * t + 0.001308 * t * t * t);
}

using Matrix12d = Eigen::Matrix<double, 12, 12>;
using Matrix12Xd = Eigen::Matrix<double, 12, Eigen::Dynamic>;

// Rows of the covariance of the common parameters that an epoch touches.
Eigen::MatrixXd gather_rows(const Eigen::MatrixXd& covariance, const std::vector<int>& columns) {
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(columns.size()), covariance.cols());
  for (Eigen::Index j = 0; j < rows.cols(); ++j) {
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
      rows(i, j) = covariance(columns[static_cast<std::size_t>(i)], j);
    }
  }
  return rows;
}

// How a photograph and its epoch follow the common parameters, P = [photo; epoch].by_common: P C with all
// common parameters, and P C P^T. Every sighting of the photograph takes its share from these.
struct FollowedCommon {
  Matrix12Xd with_all;
  Matrix12d own;
};

FollowedCommon followed_common(const EpochElimination& epoch, const PhotoElimination& photo,
                               const Eigen::MatrixXd& rows) {
  Matrix12Xd p(12, static_cast<Eigen::Index>(epoch.columns.size()));
  p << photo.by_common, epoch.by_common;
  FollowedCommon followed;
  followed.with_all.noalias() = p * rows;
  Matrix12Xd touched(12, p.cols());
  for (Eigen::Index i = 0; i < p.cols(); ++i) {
    touched.col(i) = followed.with_all.col(epoch.columns[static_cast<std::size_t>(i)]);
  }
  followed.own.noalias() = touched * p.transpose();
  return followed;
}

// Covariance of a sighting's prediction (whitened, before the variance factor), by what the photograph and
// the epoch add of their own and by the common parameters; see PhotoElimination.
struct PredictedCovariance {
  Matrix8d own, common;
};

PredictedCovariance predicted_covariance(const EpochElimination& epoch, const PhotoElimination& photo,
                                         const SightingJacobian& jacobian, bool moving,
                                         const CommonJacobian& common, const FollowedCommon& followed,
                                         const Eigen::MatrixXd& covariance) {
  Matrix86d by_epoch = -jacobian.photo * photo.by_epoch;
  if (moving) by_epoch += jacobian.epoch;
  Eigen::Matrix<double, 8, 12> a;
  a << -jacobian.photo, -by_epoch;
  const Eigen::Index n = common.values.cols();
  Eigen::Matrix<double, 12, Eigen::Dynamic, 0, 12, CommonJacobian::kMax> with_own(12, n);
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
  predicted.own = jacobian.photo * photo.inverse * jacobian.photo.transpose();
  if (epoch.has_pose) predicted.own += by_epoch * epoch.inverse * by_epoch.transpose();
  return predicted;
}

}  // namespace

double chi2_quantile(int dof, double exceeded) {
  const double spread = 2.0 / (9.0 * dof);
  return dof * std::pow(1 - spread + normal_quantile(exceeded) * std::sqrt(spread), 3);
}

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
    const Eigen::MatrixXd rows = gather_rows(covariance, epoch.columns);
    const PhotoElimination* photo = nullptr;
    FollowedCommon followed;
    SightingJacobian jacobian;
    CommonJacobian common;
    Vector8d r;
    for (const std::size_t s : members[e]) {
      const Sighting& sighting = sightings[s];
      if (photo == nullptr || photo->photo != sighting.photo) {
        const auto found = std::find_if(epoch.photos.begin(), epoch.photos.end(),
                                        [&](const auto& entry) { return entry.photo == sighting.photo; });
        photo = found == epoch.photos.end() ? nullptr : &*found;
        if (photo != nullptr) followed = followed_common(epoch, *photo, rows);
      }
      const bool moving = network.markers[static_cast<std::size_t>(sighting.marker)].body == Body::moving;
      tests[s].statistic = std::numeric_limits<double>::infinity();
      if (photo == nullptr || (moving && !epoch.has_pose)) continue;
      if (!sighting_residual(network, geometry, sighting, r, &jacobian)) continue;
      common_jacobian(layout, network.photos[static_cast<std::size_t>(sighting.photo)].camera, sighting,
                      jacobian, common);
      PredictedCovariance predicted =
          predicted_covariance(epoch, *photo, jacobian, moving, common, followed, covariance);
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
