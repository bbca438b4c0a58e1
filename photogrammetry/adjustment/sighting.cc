#include "photogrammetry/adjustment/sighting.h"

#include <Eigen/Cholesky>
#include <map>

namespace hexcal {
namespace {

// Keeps a whitener finite where a detector claims an exact point.
constexpr double kFloorPx2 = 1e-10;

double mean_side_px(const Sighting& sighting) {
  double sum = 0;
  for (int i = 0; i < sighting.points; ++i) {
    sum += (sighting.px.segment<2>(2 * i) - sighting.px.segment<2>(2 * ((i + 1) % sighting.points))).norm();
  }
  return sum / sighting.points;
}

void take_measurement(const Observation& seen, const NetworkFeature& feature, Sighting& sighting) {
  sighting.points = feature.points();
  const Eigen::Index rows = seen.px.size();
  if (!seen.measured || rows != 2 * feature.points() || seen.covariance_px2.rows() != rows ||
      !seen.px.allFinite()) {
    sighting.status = SightingStatus::not_measured;
    return;
  }
  sighting.px.head(rows) = seen.px;
  sighting.covariance_px2.topLeftCorner(rows, rows) = seen.covariance_px2;
  sighting.side_px = mean_side_px(sighting);
  if (!use_all_points(sighting)) sighting.status = SightingStatus::not_measured;
}

}  // namespace

bool use_all_points(Sighting& sighting) {
  for (int i = 0; i < kMaxFeaturePoints; ++i)
    sighting.point_used[static_cast<std::size_t>(i)] = i < sighting.points;
  return whiten(sighting);
}

bool whiten(Sighting& sighting) {
  std::array<int, 8> index{};
  int rows = 0;
  for (int c = 0; c < kMaxFeaturePoints; ++c) {
    if (!sighting.point_used[static_cast<std::size_t>(c)]) continue;
    index[static_cast<std::size_t>(rows++)] = 2 * c;
    index[static_cast<std::size_t>(rows++)] = 2 * c + 1;
  }
  Eigen::MatrixXd covariance(rows, rows);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < rows; ++j) {
      covariance(i, j) =
          sighting.covariance_px2(index[static_cast<std::size_t>(i)], index[static_cast<std::size_t>(j)]);
    }
    covariance(i, i) += kFloorPx2;
  }
  const Eigen::LLT<Eigen::MatrixXd> llt(covariance);
  if (rows == 0 || llt.info() != Eigen::Success || !covariance.allFinite()) return false;
  const Eigen::MatrixXd inverse_factor = llt.matrixL().solve(Eigen::MatrixXd::Identity(rows, rows));
  sighting.whitener.setZero();
  for (int j = 0; j < rows; ++j) {
    sighting.whitener.col(index[static_cast<std::size_t>(j)]).head(rows) = inverse_factor.col(j);
  }
  sighting.rows = rows;
  return true;
}

std::vector<Sighting> collect_sightings(const Network& network) {
  std::map<int, int> index_of;
  for (std::size_t f = 0; f < network.features.size(); ++f)
    index_of[network.features[f].id] = static_cast<int>(f);
  std::vector<Sighting> sightings;
  std::vector<int> views(network.features.size(), 0);
  for (std::size_t p = 0; p < network.photos.size(); ++p) {
    std::map<int, int> times;
    for (const Observation& seen : network.photos[p].observations) ++times[seen.id];
    for (const Observation& seen : network.photos[p].observations) {
      Sighting sighting;
      sighting.photo = static_cast<int>(p);
      const auto known = index_of.find(seen.id);
      if (known == index_of.end()) {
        sighting.status = SightingStatus::unknown_id;
      } else {
        sighting.feature = known->second;
        if (times[seen.id] > 1) sighting.status = SightingStatus::repeated_id;
        take_measurement(seen, network.features[static_cast<std::size_t>(known->second)], sighting);
      }
      if (sighting.status == SightingStatus::used) ++views[static_cast<std::size_t>(sighting.feature)];
      sightings.push_back(sighting);
    }
  }
  for (Sighting& sighting : sightings) {
    if (sighting.status != SightingStatus::used) continue;
    const auto f = static_cast<std::size_t>(sighting.feature);
    if (views[f] < 2 && !network.features[f].body_from_feature) sighting.status = SightingStatus::seen_once;
  }
  return sightings;
}

}  // namespace hexcal
