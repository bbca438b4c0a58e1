#include "pose_extract/marker_slips.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "kinematics/geometry/chi_squared.h"
#include "photogrammetry/adjustment/projection.h"

namespace hexcal {
namespace {

constexpr double kSlipProbability = 1e-6;  // of one in a campaign without any
constexpr double kSlipFactor = 9;          // of the noise, squared, at least
constexpr double kLeastSlipMm = 0.005;     // paper moves as much with the air
// Markers of a body that must be in a photograph beside one that is judged.
constexpr int kFewestOthers = 2;

// What sightings say of a marker's displacement (perturbation of body_from_feature): N d = b.
struct Evidence {
  Matrix6d normal = Matrix6d::Zero();
  Vector6d right = Vector6d::Zero();
  double squares = 0;  // of the residuals, whitened
  int rows = 0;
  int sightings = 0;
  Evidence& operator+=(const Evidence& more) {
    normal += more.normal;
    right += more.right;
    squares += more.squares;
    rows += more.rows;
    sightings += more.sightings;
    return *this;
  }
  [[nodiscard]] Vector6d displacement() const { return normal.ldlt().solve(right); }
  // What is left of the squares about its own displacement.
  [[nodiscard]] double left() const { return squares - right.dot(displacement()); }
};

struct PhotoBodyView {
  struct Seen {
    const Sighting* sighting;
    Vector8d residual;
    Matrix86d station, feature;
  };
  std::vector<Seen> seen;
  Matrix6d normal = Matrix6d::Zero();
  Vector6d right = Vector6d::Zero();
};

// Sightings of one body in one photograph, those that the adjustment left out among them.
PhotoBodyView view_body(const Network& network, const AdjustmentResult& adjusted,
                        const std::vector<const Sighting*>& sightings) {
  PhotoBodyView view;
  FeatureJacobian jacobian;
  jacobian.with_shape = false;
  for (const Sighting* sighting : sightings) {
    PhotoBodyView::Seen seen{sighting, Vector8d::Zero(), Matrix86d::Zero(), Matrix86d::Zero()};
    if (!whitened_residual(network, adjusted.geometry, *sighting, seen.residual, &jacobian)) continue;
    seen.station = jacobian.station;
    seen.feature = jacobian.feature;
    if (sighting->status == SightingStatus::used) {
      view.normal += seen.station.transpose() * seen.station;
      view.right += seen.station.transpose() * seen.residual;
    }
    view.seen.push_back(seen);
  }
  return view;
}

// Evidence of each marker in each of `epochs`, by feature and place in the order.
std::vector<std::vector<Evidence>> gather_evidence(const Network& network, const AdjustmentResult& adjusted,
                                                   const std::vector<std::size_t>& epochs) {
  std::vector<std::vector<Evidence>> evidence(network.features.size(), std::vector<Evidence>(epochs.size()));
  std::vector<std::size_t> place(static_cast<std::size_t>(network.num_epochs), epochs.size());
  for (std::size_t i = 0; i < epochs.size(); ++i) place[epochs[i]] = i;
  std::vector<std::vector<const Sighting*>> groups(network.photos.size() *
                                                   static_cast<std::size_t>(network.num_bodies));
  for (const Sighting& sighting : adjusted.sightings) {
    if (sighting.feature < 0) continue;
    const auto f = static_cast<std::size_t>(sighting.feature);
    const auto p = static_cast<std::size_t>(sighting.photo);
    const bool placed = adjusted.geometry.has_feature[f] && adjusted.geometry.has_photo[p] &&
                        adjusted.geometry.has_body(network.features[f].body, network.photos[p].epoch);
    if (!placed || (sighting.status != SightingStatus::used && sighting.status != SightingStatus::outlier))
      continue;
    groups[p * static_cast<std::size_t>(network.num_bodies) +
           static_cast<std::size_t>(network.features[f].body)]
        .push_back(&sighting);
  }
  for (const auto& group : groups) {
    const PhotoBodyView view = view_body(network, adjusted, group);
    for (const PhotoBodyView::Seen& seen : view.seen) {
      const std::size_t at = place[static_cast<std::size_t>(
          network.photos[static_cast<std::size_t>(seen.sighting->photo)].epoch)];
      if (at >= epochs.size()) continue;
      // The camera from the body's other markers.
      Matrix6d others = view.normal;
      Vector6d others_right = view.right;
      if (seen.sighting->status == SightingStatus::used) {
        others -= seen.station.transpose() * seen.station;
        others_right -= seen.station.transpose() * seen.residual;
      }
      const auto count = std::count_if(view.seen.begin(), view.seen.end(), [&](const auto& other) {
        return &other != &seen && other.sighting->status == SightingStatus::used;
      });
      if (count < kFewestOthers) continue;
      const Eigen::LDLT<Matrix6d> ldlt(others);
      if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > 0)) continue;
      const Vector8d residual = seen.residual - seen.station * ldlt.solve(others_right);
      const Matrix8d weight =
          (Matrix8d::Identity() + seen.station * ldlt.solve(seen.station.transpose())).inverse();
      Evidence& sum = evidence[static_cast<std::size_t>(seen.sighting->feature)][at];
      sum.normal += seen.feature.transpose() * weight * seen.feature;
      sum.right += seen.feature.transpose() * weight * residual;
      sum.squares += residual.dot(weight * residual);
      sum.rows += seen.sighting->rows;
      ++sum.sightings;
    }
  }
  return evidence;
}

bool tells_place(const Evidence& evidence) {
  const Eigen::LDLT<Matrix6d> ldlt(evidence.normal);
  return evidence.rows > 8 && ldlt.info() == Eigen::Success && ldlt.vectorD().minCoeff() > 0;
}

struct Step {
  double chi2 = 0;  // over what the sides scatter, where that is more than the noise; 0: not known
  double moved_mm = 0;
  int epochs_before = 0, epochs_after = 0, sightings_before = 0, sightings_after = 0;
};

// Of a marker between epochs `k` and k + 1, without one of them.
Step step_at(const std::vector<Evidence>& evidence, std::size_t k, std::size_t left_out) {
  Evidence before, after;
  Step step;
  for (std::size_t i = 0; i < evidence.size(); ++i) {
    if (i == left_out || evidence[i].sightings == 0) continue;
    (i <= k ? before : after) += evidence[i];
    ++(i <= k ? step.epochs_before : step.epochs_after);
  }
  if (!tells_place(before) || !tells_place(after)) return step;
  step.sightings_before = before.sightings;
  step.sightings_after = after.sightings;
  const Vector6d moved = after.displacement() - before.displacement();
  const Matrix6d covariance = before.normal.inverse() + after.normal.inverse();
  const double factor = std::max(1.0, (before.left() + after.left()) / (before.rows + after.rows - 12));
  step.chi2 = moved.dot(covariance.inverse() * moved) / factor;
  step.moved_mm = moved.head<3>().norm();
  return step;
}

}  // namespace

std::optional<MarkerSlip> find_marker_slip(const Network& network, const AdjustmentResult& adjusted,
                                           const std::vector<std::size_t>& epochs) {
  std::optional<MarkerSlip> found;
  if (epochs.size() < 3) return found;
  const auto tests = static_cast<double>(network.features.size() * (epochs.size() - 1));
  const double limit = std::max(chi2_quantile(6, kSlipProbability / tests), kSlipFactor * 6);
  const auto evidence = gather_evidence(network, adjusted, epochs);
  for (std::size_t f = 0; f < evidence.size(); ++f) {
    for (std::size_t k = 0; k + 1 < epochs.size(); ++k) {
      if (evidence[f][k].sightings == 0) continue;
      const Step step = step_at(evidence[f], k, epochs.size());
      const double statistic = step.chi2 / limit;
      if (statistic <= 1 || step.moved_mm < kLeastSlipMm || (found && found->statistic >= statistic))
        continue;
      // A single epoch in which it stood elsewhere is no step.
      bool lasts = true;
      for (std::size_t left_out = 0; left_out < epochs.size() && lasts; ++left_out) {
        const bool alone = left_out <= k ? step.epochs_before < 2 : step.epochs_after < 2;
        if (alone || evidence[f][left_out].sightings == 0) continue;
        lasts = step_at(evidence[f], k, left_out).chi2 > limit;
      }
      if (!lasts) continue;
      std::size_t next = k + 1;
      while (evidence[f][next].sightings == 0) ++next;
      found = MarkerSlip{static_cast<int>(f),
                         epochs[k],
                         epochs[next],
                         step.moved_mm,
                         statistic,
                         step.sightings_after > 2 * step.sightings_before,
                         false};
    }
  }
  return found;
}

}  // namespace hexcal
