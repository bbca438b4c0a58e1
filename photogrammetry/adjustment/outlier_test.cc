#include "photogrammetry/adjustment/outlier_test.h"

#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
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

// Covariance of the epoch's common parameters, in its compact columns.
Eigen::MatrixXd gather(const Eigen::MatrixXd& covariance, const std::vector<int>& columns) {
  const auto n = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd compact(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      compact(j, i) = covariance(columns[static_cast<std::size_t>(j)], columns[static_cast<std::size_t>(i)]);
    }
  }
  return compact;
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
    const EpochElimination& epoch = system.epochs[e];
    const Eigen::MatrixXd local = gather(covariance, epoch.columns);
    const auto width = static_cast<Eigen::Index>(epoch.columns.size());
    std::vector<int> compact(static_cast<std::size_t>(layout.size), -1);
    for (std::size_t i = 0; i < epoch.columns.size(); ++i) {
      compact[static_cast<std::size_t>(epoch.columns[i])] = static_cast<int>(i);
    }
    SightingJacobian jacobian;
    CommonJacobian common;
    Vector8d r;
    Eigen::MatrixXd by_common(8, width);
    for (const std::size_t s : members[e]) {
      const Sighting& sighting = sightings[s];
      const PhotoElimination* photo = nullptr;
      for (const PhotoElimination& candidate : epoch.photos) {
        if (candidate.photo == sighting.photo) photo = &candidate;
      }
      const bool moving = network.markers[static_cast<std::size_t>(sighting.marker)].body == Body::moving;
      tests[s].statistic = std::numeric_limits<double>::infinity();
      if (photo == nullptr || (moving && !epoch.has_pose)) continue;
      if (!sighting_residual(network, geometry, sighting, r, &jacobian)) continue;
      common_jacobian(layout, network.photos[static_cast<std::size_t>(sighting.photo)].camera, sighting,
                      jacobian, common);
      // Errors of photograph and epoch expressed by independent parts (see PhotoElimination).
      Matrix86d by_epoch = -jacobian.photo * photo->by_epoch;
      if (moving) by_epoch += jacobian.epoch;
      by_common.noalias() = -jacobian.photo * photo->by_common;
      by_common.noalias() -= by_epoch * epoch.by_common;
      bool known = true;
      for (Eigen::Index i = 0; i < common.values.cols(); ++i) {
        const int column = compact[static_cast<std::size_t>(common.column[static_cast<std::size_t>(i)])];
        if (column >= 0) {
          by_common.col(column) += common.values.col(i);
        } else {
          known = false;  // its marker is used nowhere in this epoch: take the marker's own covariance below
        }
      }
      Matrix8d predicted = jacobian.photo * photo->inverse * jacobian.photo.transpose();
      if (epoch.has_pose) predicted += by_epoch * epoch.inverse * by_epoch.transpose();
      predicted += by_common * local * by_common.transpose();
      if (!known) {
        for (Eigen::Index i = 0; i < common.values.cols(); ++i) {
          const int ci = common.column[static_cast<std::size_t>(i)];
          if (compact[static_cast<std::size_t>(ci)] >= 0) continue;
          for (Eigen::Index j = 0; j < common.values.cols(); ++j) {
            const int cj = common.column[static_cast<std::size_t>(j)];
            if (compact[static_cast<std::size_t>(cj)] >= 0) continue;
            predicted += covariance(ci, cj) * common.values.col(i) * common.values.col(j).transpose();
          }
        }
      }
      predicted /= settings.data_variance;
      const int n = sighting.rows;
      const double sign = sighting.status == SightingStatus::used ? -1.0 : 1.0;
      const Eigen::MatrixXd q = Eigen::MatrixXd::Identity(n, n) + sign * predicted.topLeftCorner(n, n);
      const Eigen::VectorXd rn = r.head(n) / std::sqrt(settings.data_variance);
      tests[s].redundancy = sign < 0 ? q.trace() / n : 0.0;
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
