#include "photogrammetry/adjustment/adjustment_statistics.h"

#include <algorithm>
#include <cmath>

#include "photogrammetry/adjustment/planar_pose.h"

namespace hexcal {
namespace {

// Two planar solutions count as undecided when the second raises the sum of squares by less than this.
constexpr double kAmbiguousSquares = 30;

Matrix6Xd spread(const Matrix6Xd& compact, const std::vector<int>& columns, int size) {
  Matrix6Xd full = Matrix6Xd::Zero(6, size);
  for (std::size_t i = 0; i < columns.size(); ++i)
    full.col(columns[i]) = compact.col(static_cast<Eigen::Index>(i));
  return full;
}

struct Sums {
  std::vector<double> squares, redundancy;
  std::vector<int> corners;
  explicit Sums(std::size_t n) : squares(n, 0), redundancy(n, 0), corners(n, 0) {}
};

void add(const Sighting& sighting, const Vector8d& residual_px, double redundancy, std::size_t i, Sums& sums,
         std::vector<ResidualSummary>& summaries) {
  ResidualSummary& summary = summaries[i];
  if (sighting.status == SightingStatus::outlier) ++summary.rejected;
  if (sighting.status != SightingStatus::used) return;
  ++summary.markers;
  sums.redundancy[i] += redundancy;
  for (int c = 0; c < 4; ++c) {
    if (!sighting.corner_used[static_cast<std::size_t>(c)]) continue;
    const double norm = residual_px.segment<2>(2 * c).norm();
    sums.squares[i] += norm * norm;
    ++sums.corners[i];
    summary.worst_px = std::max(summary.worst_px, norm);
  }
}

void finish(const Sums& sums, std::vector<ResidualSummary>& summaries) {
  for (std::size_t i = 0; i < summaries.size(); ++i) {
    if (sums.corners[i] > 0) summaries[i].rms_px = std::sqrt(sums.squares[i] / (2 * sums.corners[i]));
    if (summaries[i].markers > 0) summaries[i].redundancy = sums.redundancy[i] / summaries[i].markers;
  }
}

// A photograph held by a single marker whose other planar pose explains it as well.
void find_ambiguous(const Network& network, AdjustmentResult& result) {
  result.photo_ambiguous.assign(network.photos.size(), 0);
  for (const Sighting& sighting : result.sightings) {
    const auto p = static_cast<std::size_t>(sighting.photo);
    if (sighting.status != SightingStatus::used || result.photo_residuals[p].markers != 1) continue;
    const auto m = static_cast<std::size_t>(sighting.marker);
    const CameraModel& camera = result.geometry.cameras[static_cast<std::size_t>(network.photos[p].camera)];
    const std::vector<PlanarPose> poses =
        planar_marker_poses(camera, sighting.px, network.markers[m].size_mm);
    if (poses.size() < 2) continue;
    const double variance =
        std::max(sighting.covariance_px2.trace() / 8, 1e-12) * std::max(1.0, result.sigma0);
    const double difference =
        8 * (poses[1].rms_px * poses[1].rms_px - poses[0].rms_px * poses[0].rms_px) / variance;
    result.photo_ambiguous[p] = difference < kAmbiguousSquares;
  }
}

}  // namespace

void export_covariances(const EpochElimination& elimination, std::size_t epoch, AdjustmentResult& result) {
  const auto full = [&](const Matrix6Xd& compact) {
    return spread(compact, elimination.columns, result.layout.size);
  };
  result.epochs[epoch] = {elimination.inverse, full(elimination.by_common)};
  for (const PhotoElimination& photo : elimination.photos) {
    result.photo_covariances[static_cast<std::size_t>(photo.photo)] = {photo.inverse, photo.by_epoch,
                                                                       full(photo.by_common)};
  }
}

void summarise_residuals(const Network& network, const std::vector<SightingTest>& tests,
                         AdjustmentResult& result) {
  result.residuals_px.assign(result.sightings.size(), Vector8d::Zero());
  result.redundancy.assign(result.sightings.size(), 0);
  result.photo_residuals.assign(network.photos.size(), {});
  result.marker_residuals.assign(network.markers.size(), {});
  result.epoch_residuals.assign(static_cast<std::size_t>(network.num_epochs), {});
  Sums photos(network.photos.size());
  Sums markers(network.markers.size());
  Sums epochs(static_cast<std::size_t>(network.num_epochs));
  double squares = 0;
  int corners = 0;
  for (std::size_t s = 0; s < result.sightings.size(); ++s) {
    const Sighting& sighting = result.sightings[s];
    if (sighting.status != SightingStatus::used && sighting.status != SightingStatus::outlier) continue;
    const auto p = static_cast<std::size_t>(sighting.photo);
    const auto m = static_cast<std::size_t>(sighting.marker);
    const auto e = static_cast<std::size_t>(network.photos[p].epoch);
    const bool known = result.geometry.has_photo[p] && result.geometry.has_marker[m] &&
                       (network.markers[m].body == Body::fixed || result.geometry.has_epoch[e]);
    Vector8d px;
    if (known && project_marker(view_of(network, result.geometry, sighting), network.markers[m].size_mm,
                                result.geometry.print_scale, result.geometry.shape_mm[m], px, nullptr)) {
      result.residuals_px[s] = sighting.px - px;
    }
    result.redundancy[s] = tests[s].redundancy;
    add(sighting, result.residuals_px[s], tests[s].redundancy, p, photos, result.photo_residuals);
    add(sighting, result.residuals_px[s], tests[s].redundancy, m, markers, result.marker_residuals);
    add(sighting, result.residuals_px[s], tests[s].redundancy, e, epochs, result.epoch_residuals);
  }
  finish(photos, result.photo_residuals);
  finish(markers, result.marker_residuals);
  finish(epochs, result.epoch_residuals);
  for (std::size_t p = 0; p < network.photos.size(); ++p) {
    squares += photos.squares[p];
    corners += photos.corners[p];
  }
  result.rms_px = corners > 0 ? std::sqrt(squares / (2 * corners)) : 0;
  find_ambiguous(network, result);
}

Matrix6d epoch_covariance(const AdjustmentResult& result, int epoch_a, int epoch_b) {
  const EpochCovariance& a = result.epochs[static_cast<std::size_t>(epoch_a)];
  const EpochCovariance& b = result.epochs[static_cast<std::size_t>(epoch_b)];
  Matrix6d covariance = a.by_common * result.common_covariance * b.by_common.transpose();
  if (epoch_a == epoch_b) covariance += a.own;
  return covariance;
}

Matrix6d photo_covariance(const AdjustmentResult& result, int photo, int epoch) {
  const PhotoCovariance& own = result.photo_covariances[static_cast<std::size_t>(photo)];
  const EpochCovariance& pose = result.epochs[static_cast<std::size_t>(epoch)];
  const Matrix6Xd by_common = own.by_common - own.by_epoch * pose.by_common;
  return own.own + own.by_epoch * pose.own * own.by_epoch.transpose() +
         by_common * result.common_covariance * by_common.transpose();
}

}  // namespace hexcal
