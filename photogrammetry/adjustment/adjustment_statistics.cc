#include "photogrammetry/adjustment/adjustment_statistics.h"

#include <algorithm>
#include <cmath>

namespace hexcal {
namespace {

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
  for (int c = 0; c < sighting.points; ++c) {
    if (!sighting.point_used[static_cast<std::size_t>(c)]) continue;
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

}  // namespace

void summarise_residuals(const Network& network, const std::vector<SightingTest>& tests,
                         AdjustmentResult& result) {
  result.residuals_px.assign(result.sightings.size(), Vector8d::Zero());
  result.redundancy.assign(result.sightings.size(), 0);
  result.photo_residuals.assign(network.photos.size(), {});
  result.feature_residuals.assign(network.features.size(), {});
  result.epoch_residuals.assign(static_cast<std::size_t>(network.num_epochs), {});
  Sums photos(network.photos.size());
  Sums features(network.features.size());
  Sums epochs(static_cast<std::size_t>(network.num_epochs));
  double squares = 0;
  int corners = 0;
  for (std::size_t s = 0; s < result.sightings.size(); ++s) {
    const Sighting& sighting = result.sightings[s];
    if (sighting.status != SightingStatus::used && sighting.status != SightingStatus::outlier) continue;
    const auto p = static_cast<std::size_t>(sighting.photo);
    const auto f = static_cast<std::size_t>(sighting.feature);
    const auto e = static_cast<std::size_t>(network.photos[p].epoch);
    const bool known = result.geometry.has_photo[p] && result.geometry.has_feature[f] &&
                       result.geometry.has_body(network.features[f].body, network.photos[p].epoch);
    if (known && !residual_px(network, result.geometry, sighting, result.residuals_px[s], nullptr))
      result.residuals_px[s].setZero();
    result.redundancy[s] = tests[s].redundancy;
    add(sighting, result.residuals_px[s], tests[s].redundancy, p, photos, result.photo_residuals);
    add(sighting, result.residuals_px[s], tests[s].redundancy, f, features, result.feature_residuals);
    add(sighting, result.residuals_px[s], tests[s].redundancy, e, epochs, result.epoch_residuals);
  }
  finish(photos, result.photo_residuals);
  finish(features, result.feature_residuals);
  finish(epochs, result.epoch_residuals);
  for (std::size_t p = 0; p < network.photos.size(); ++p) {
    squares += photos.squares[p];
    corners += photos.corners[p];
  }
  result.rms_px = corners > 0 ? std::sqrt(squares / (2 * corners)) : 0;
}

}  // namespace hexcal
