#include "pose_extract/photo_motions.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "kinematics/geometry/covariance.h"
#include "photogrammetry/adjustment/projection.h"

namespace hexcal {
namespace {

constexpr int kPhotoIterations = 5;
constexpr double kLeastPhotoRedundancy = 6;  // for a noise factor of its own

using Vector12d = Eigen::Matrix<double, 12, 1>;
using Matrix12d = Eigen::Matrix<double, 12, 12>;
using Matrix812d = Eigen::Matrix<double, 8, 12>;

struct PhotoSightings {
  std::vector<const Sighting*> fixed, moving, moving_rejected;
};

std::vector<PhotoSightings> by_photo(const Network& network, const AdjustmentResult& adjusted) {
  std::vector<PhotoSightings> photos(network.photos.size());
  for (const Sighting& sighting : adjusted.sightings) {
    if (sighting.feature < 0) continue;
    const auto f = static_cast<std::size_t>(sighting.feature);
    if (!adjusted.geometry.has_feature[f]) continue;
    PhotoSightings& photo = photos[static_cast<std::size_t>(sighting.photo)];
    const bool fixed = network.features[f].body == kReferenceBody;
    if (sighting.status == SightingStatus::used) {
      (fixed ? photo.fixed : photo.moving).push_back(&sighting);
    } else if (sighting.status == SightingStatus::outlier && !fixed) {
      photo.moving_rejected.push_back(&sighting);
    }
  }
  return photos;
}

// Sum of squares of the whitened residuals of `sightings`, with the normal equations of (station, body) if
// asked; infinite where one cannot be projected.
double sum_of_squares(const Network& network, const NetworkGeometry& geometry,
                      const std::vector<const Sighting*>& sightings, Matrix12d* normal, Vector12d* right) {
  double squares = 0;
  FeatureJacobian jacobian;
  jacobian.with_shape = false;
  Vector8d r;
  for (const Sighting* sighting : sightings) {
    const bool moving = network.features[static_cast<std::size_t>(sighting->feature)].body != kReferenceBody;
    if (!whitened_residual(network, geometry, *sighting, r, normal != nullptr ? &jacobian : nullptr))
      return std::numeric_limits<double>::infinity();
    squares += r.squaredNorm();
    if (normal == nullptr) continue;
    Matrix812d j = Matrix812d::Zero();
    j.leftCols<6>() = jacobian.station;
    if (moving) j.rightCols<6>() = jacobian.pose;
    *normal += j.transpose() * j;
    *right += j.transpose() * r;
  }
  return squares;
}

struct PhotoFit {
  bool ok = false;
  Vector6d motion;       // perturbation of reference_from_body
  Matrix6d information;  // of motion, for unit noise
  double squares = 0;    // left
};

PhotoFit fit_photo(const Network& network, NetworkGeometry& geometry, std::size_t photo,
                   const std::vector<const Sighting*>& sightings) {
  PhotoFit fit;
  const auto epoch = static_cast<std::size_t>(network.photos[photo].epoch);
  Rigid3& station = geometry.camera_from_reference[photo];
  Rigid3& body = geometry.reference_from_body[kMovingBody][epoch];
  const Rigid3 station_before = station;
  const Rigid3 body_before = body;
  for (int i = 0; i < kPhotoIterations; ++i) {
    Matrix12d normal = Matrix12d::Zero();
    Vector12d right = Vector12d::Zero();
    if (!std::isfinite(sum_of_squares(network, geometry, sightings, &normal, &right))) break;
    const Eigen::LDLT<Matrix12d> ldlt(normal);
    if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > 0)) break;
    const Vector12d step = ldlt.solve(right);
    station = perturbed(station, step.head<6>());
    body = perturbed(body, step.tail<6>());
    const Matrix6d own = normal.topLeftCorner<6, 6>();
    const Matrix6d crossed = normal.topRightCorner<6, 6>();
    fit.information = normal.bottomRightCorner<6, 6>() - crossed.transpose() * own.ldlt().solve(crossed);
    fit.ok = i + 1 == kPhotoIterations;
  }
  fit.motion = perturbation_between(body_before, body);
  fit.squares = sum_of_squares(network, geometry, sightings, nullptr, nullptr);
  fit.ok = fit.ok && std::isfinite(fit.squares) && fit.motion.allFinite() &&
           Eigen::LLT<Matrix6d>(fit.information).info() == Eigen::Success;
  station = station_before;
  body = body_before;
  return fit;
}

}  // namespace

Matrix6d about_middle(const Network& network, const NetworkGeometry& geometry, std::size_t epoch) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double count = 0;
  for (std::size_t f = 0; f < network.features.size(); ++f) {
    if (network.features[f].body != kMovingBody || !geometry.has_feature[f]) continue;
    middle += geometry.body_from_feature[f].translation;
    count += 1;
  }
  if (count > 0) middle /= count;
  Matrix6d about = Matrix6d::Identity();
  about.topRightCorner<3, 3>() =
      -skew(geometry.reference_from_body[kMovingBody][epoch].rotation_matrix() * middle);
  return about;
}

PhotoMotions photo_motions(const Network& network, const AdjustmentResult& adjusted) {
  PhotoMotions out;
  out.noise_factor = adjusted.sigma0 * adjusted.sigma0;
  NetworkGeometry geometry = adjusted.geometry;
  double squares = 0;
  double redundancy = adjusted.redundancy_total;
  std::vector<int> in_epoch(static_cast<std::size_t>(network.num_epochs), 0);
  const std::vector<PhotoSightings> photos = by_photo(network, adjusted);
  for (std::size_t p = 0; p < photos.size(); ++p) {
    const PhotoSightings& seen = photos[p];
    const auto epoch = static_cast<std::size_t>(network.photos[p].epoch);
    if (!geometry.has_photo[p]) continue;
    std::vector<const Sighting*> sightings = seen.fixed;
    sightings.insert(sightings.end(), seen.moving.begin(), seen.moving.end());
    const bool rejected = seen.moving_rejected.size() > seen.moving.size();
    const double before = sum_of_squares(network, geometry, sightings, nullptr, nullptr);
    const bool fits = geometry.has_body(kMovingBody, static_cast<int>(epoch)) && !seen.fixed.empty() &&
                      seen.moving.size() + (rejected ? seen.moving_rejected.size() : 0) > 0;
    PhotoFit fit;
    if (fits) {
      if (rejected)
        sightings.insert(sightings.end(), seen.moving_rejected.begin(), seen.moving_rejected.end());
      fit = fit_photo(network, geometry, p, sightings);
    }
    squares += fit.ok && !rejected ? fit.squares : (std::isfinite(before) ? before : 0);
    if (!fit.ok) continue;
    if (!rejected && ++in_epoch[epoch] > 1) redundancy -= 6;
    const Matrix6d about = about_middle(network, geometry, epoch);
    const Matrix6d back = about.inverse();
    out.motions.push_back(
        {p, epoch, about * fit.motion, back.transpose() * fit.information * back, !rejected});
  }
  if (redundancy >= kLeastPhotoRedundancy)
    out.noise_factor = std::min(out.noise_factor, squares / redundancy);
  out.noise_factor = std::max(out.noise_factor, 1e-12);
  for (PhotoMotion& motion : out.motions) motion.information /= out.noise_factor;
  return out;
}

}  // namespace hexcal
