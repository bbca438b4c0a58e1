#include "pose_extract/marker_groups.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

namespace hexcal {
namespace {

constexpr double kMostContradicting =
    0.25;                                // share of a photograph's markers that may be rejected in its pose
constexpr std::size_t kLeastCommon = 3;  // markers by which a photograph is compared with others
constexpr std::size_t kComparedPhotos = 3;  // of the run so far, the last ones
constexpr std::size_t kMostScenes = 40;
// A change of a distance below this share of a marker's edge is not trusted, whatever its sigma says:
// stickers give, and lenses are not quite what their calibration says.
constexpr double kLeastChange = 0.004;
constexpr double kMovesAt = 6;       // chance-normalised change from which two markers moved
constexpr double kClearlyApart = 3;  // least_between over largest_inside

std::set<int> ids_of(const CampaignPhotograph& photograph, const MarkerSizes& sizes) {
  std::set<int> ids;
  for (const MarkerObservation& marker : photograph.seen.markers) {
    if (marker.status == MarkerStatus::ok && sizes.count(marker.id) != 0) ids.insert(marker.id);
  }
  return ids;
}

std::vector<std::size_t> contradicting_photographs(const StillScene& scene) {
  std::vector<std::size_t> contradicting;
  for (std::size_t p = 0; p < scene.photographs.size(); ++p) {
    int rejected = 0;
    int all = 0;
    for (const Sighting& sighting : scene.adjusted.sightings) {
      if (sighting.photo != static_cast<int>(p)) continue;
      if (sighting.status == SightingStatus::used) ++all;
      if (sighting.status != SightingStatus::outlier) continue;
      ++all;
      ++rejected;
    }
    if (rejected > kMostContradicting * all || !scene.adjusted.geometry.has_photo[p])
      contradicting.push_back(scene.photographs[p]);
  }
  return contradicting;
}

StillScene adjusted_scene(const CampaignObservations& observations,
                          const std::vector<std::size_t>& photographs, const MarkerSizes& sizes,
                          AdjustmentOptions::Shape shape) {
  StillScene scene;
  scene.photographs = photographs;
  for (const CalibratedCamera& camera : observations.cameras)
    scene.network.cameras.push_back({camera.model, camera.covariance});
  scene.network.num_epochs = 1;
  scene.network.num_bodies = 1;
  std::set<int> ids;
  for (const std::size_t p : photographs) ids.merge(ids_of(observations.photographs[p], sizes));
  for (const int id : ids) (void)scene.network.add_square(id, kReferenceBody, sizes.at(id));
  for (const std::size_t p : photographs) {
    NetworkPhoto photo;
    photo.camera = std::max(0, observations.photographs[p].camera);
    for (const MarkerObservation& marker : observations.photographs[p].seen.markers) {
      if (ids.count(marker.id) != 0) photo.observations.push_back(observation_of(marker));
    }
    scene.network.photos.push_back(std::move(photo));
  }
  if (ids.size() < kLeastCommon || photographs.size() < 2) return scene;
  AdjustmentOptions options;
  options.shape = shape;
  scene.adjusted = adjust_network(scene.network, options);
  if (scene.adjusted.errors) scene.contradicting = contradicting_photographs(scene);
  return scene;
}

// The corners of a marker in a scene, with their errors.
struct PlacedMarker {
  std::array<EstimatedPoint, 4> corners;
};

std::map<int, PlacedMarker> placed_markers(const StillScene& scene) {
  std::map<int, PlacedMarker> placed;
  if (!scene.measured()) return placed;
  std::map<int, int> seen;
  for (const Sighting& sighting : scene.adjusted.sightings) {
    if (sighting.status == SightingStatus::used && sighting.feature >= 0) ++seen[sighting.feature];
  }
  for (std::size_t f = 0; f < scene.network.features.size(); ++f) {
    const int feature = static_cast<int>(f);
    if (!scene.adjusted.geometry.has_feature[f] || seen[feature] < 2) continue;
    PlacedMarker marker;
    for (int c = 0; c < 4; ++c)
      marker.corners[static_cast<std::size_t>(c)] = scene.adjusted.point(feature, c);
    placed.emplace(scene.network.features[f].id, std::move(marker));
  }
  return placed;
}

// Weighted variance of each of the 16 distances over the poses: its largest root, 1 for noise. Nothing for
// fewer than two poses.
std::optional<double> change_of_distances(const std::vector<std::map<int, PlacedMarker>>& poses, int i, int j,
                                          double least_mm) {
  std::array<std::vector<std::pair<double, double>>, 16> distances;  // value, weight
  for (const auto& placed : poses) {
    const auto a = placed.find(i);
    const auto b = placed.find(j);
    if (a == placed.end() || b == placed.end()) continue;
    for (std::size_t k = 0; k < 16; ++k) {
      const EstimatedPoint& from = a->second.corners[k / 4];
      const EstimatedPoint& to = b->second.corners[k % 4];
      const Eigen::Vector3d d = to.in_body - from.in_body;
      const double sigma = (d.normalized().transpose() * (to.by_error - from.by_error)).norm();
      distances[k].emplace_back(d.norm(), 1 / (sigma * sigma + least_mm * least_mm));
    }
  }
  if (distances[0].size() < 2) return std::nullopt;
  double largest = 0;
  for (const auto& all : distances) {
    double sum = 0;
    double weights = 0;
    for (const auto& [value, weight] : all) {
      sum += weight * value;
      weights += weight;
    }
    double squares = 0;
    for (const auto& [value, weight] : all) squares += weight * std::pow(value - sum / weights, 2);
    largest = std::max(largest, std::sqrt(squares / static_cast<double>(all.size() - 1)));
  }
  return largest;
}

using PairChanges = std::map<std::pair<int, int>, double>;

// Joins the groups that change least against each other, as long as no two of their markers moved.
std::vector<std::vector<int>> joined(const std::vector<int>& ids, const PairChanges& changes) {
  std::vector<std::vector<int>> groups;
  for (const int id : ids) groups.push_back({id});
  // The largest change between two groups; nothing if no pair of theirs was compared.
  const auto between = [&changes](const std::vector<int>& a, const std::vector<int>& b) {
    double largest = -1;
    for (const int i : a) {
      for (const int j : b) {
        const auto found = changes.find(std::minmax(i, j));
        if (found != changes.end()) largest = std::max(largest, found->second);
      }
    }
    return largest;
  };
  while (true) {
    double least = kMovesAt;
    std::pair<std::size_t, std::size_t> best{0, 0};
    for (std::size_t a = 0; a < groups.size(); ++a) {
      for (std::size_t b = a + 1; b < groups.size(); ++b) {
        const double change = between(groups[a], groups[b]);
        if (change < 0 || change >= least) continue;
        least = change;
        best = {a, b};
      }
    }
    if (best.second == 0) break;
    std::vector<int>& into = groups[best.first];
    into.insert(into.end(), groups[best.second].begin(), groups[best.second].end());
    std::sort(into.begin(), into.end());
    groups.erase(groups.begin() + static_cast<std::ptrdiff_t>(best.second));
  }
  std::stable_sort(groups.begin(), groups.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  return groups;
}

std::string doubt_about(const MarkerGroups& found) {
  if (found.poses < 2) {
    return fmt::format(
        "{}: two poses of at least two photographs each are needed to see what moves",
        found.poses == 0 ? "no pose shows its markers in two photographs" : "only one pose was compared");
  }
  if (found.groups.empty()) return "no two markers were seen together in two poses";
  if (found.groups.size() < 2 || found.groups[1].size() < 2) {
    return found.groups[0].size() < 2 ? "no two markers keep their distance"
                                      : "the markers do not move against each other";
  }
  if (found.least_between < kClearlyApart * found.largest_inside) {
    return fmt::format("markers {} and {} move against each other hardly more than they do among themselves",
                       fmt::join(found.groups[0], ", "), fmt::join(found.groups[1], ", "));
  }
  return "";
}

}  // namespace

StillScene measure_still_scene(const CampaignObservations& observations,
                               const std::vector<std::size_t>& photographs, const MarkerSizes& sizes) {
  return adjusted_scene(observations, photographs, sizes, AdjustmentOptions::Shape::automatic);
}

std::vector<std::vector<std::size_t>> split_into_poses(const CampaignObservations& observations,
                                                       const std::vector<std::size_t>& order,
                                                       const MarkerSizes& sizes) {
  std::vector<std::vector<std::size_t>> runs;
  for (const std::size_t p : order) {
    bool same = false;
    if (!runs.empty()) {
      const std::vector<std::size_t>& run = runs.back();
      std::vector<std::size_t> together(
          run.end() - static_cast<std::ptrdiff_t>(std::min(run.size(), kComparedPhotos)), run.end());
      std::set<int> before;
      for (const std::size_t q : together) before.merge(ids_of(observations.photographs[q], sizes));
      const std::set<int> now = ids_of(observations.photographs[p], sizes);
      const auto common = static_cast<std::size_t>(
          std::count_if(now.begin(), now.end(), [&before](int id) { return before.count(id) != 0; }));
      if (common >= kLeastCommon) {
        together.push_back(p);
        // Rigid: free sizes would pay for a motion.
        const StillScene scene =
            adjusted_scene(observations, together, sizes, AdjustmentOptions::Shape::rigid);
        same = scene.measured() && scene.contradicting.empty();
      }
    }
    if (same) {
      runs.back().push_back(p);
    } else {
      runs.push_back({p});
    }
  }
  return runs;
}

MarkerGroups group_markers(const std::vector<StillScene>& scenes, const MarkerSizes& sizes) {
  MarkerGroups found;
  std::vector<std::map<int, PlacedMarker>> poses;
  const std::size_t count = std::min(scenes.size(), kMostScenes);
  for (std::size_t s = 0; s < count; ++s) {
    auto placed = placed_markers(scenes[s * scenes.size() / count]);
    if (placed.size() >= 2) poses.push_back(std::move(placed));
  }
  found.poses = static_cast<int>(poses.size());
  PairChanges changes;
  std::set<int> compared;
  for (auto a = sizes.begin(); a != sizes.end(); ++a) {
    for (auto b = std::next(a); b != sizes.end(); ++b) {
      const double least_mm = kLeastChange * std::max(a->second, b->second);
      const auto change = change_of_distances(poses, a->first, b->first, least_mm);
      if (!change) continue;
      changes[{a->first, b->first}] = *change;
      compared.insert({a->first, b->first});
    }
  }
  for (const auto& [id, size] : sizes) {
    if (compared.count(id) == 0) found.unseen.push_back(id);
  }
  found.groups = joined({compared.begin(), compared.end()}, changes);
  if (found.groups.size() > 1) {
    found.least_between = std::numeric_limits<double>::infinity();
    std::map<int, std::size_t> group_of;
    for (std::size_t g = 0; g < 2; ++g)
      for (const int id : found.groups[g]) group_of[id] = g;
    for (const auto& [pair, change] : changes) {
      const auto a = group_of.find(pair.first);
      const auto b = group_of.find(pair.second);
      if (a == group_of.end() || b == group_of.end()) continue;
      if (a->second == b->second) {
        found.largest_inside = std::max(found.largest_inside, change);
      } else {
        found.least_between = std::min(found.least_between, change);
      }
    }
  }
  found.doubt = doubt_about(found);
  return found;
}

std::optional<bool> stands_above(const CampaignObservations& observations, const std::vector<int>& a,
                                 const std::vector<int>& b) {
  int above = 0;
  int below = 0;
  for (const CampaignPhotograph& photograph : observations.photographs) {
    std::array<Eigen::Vector2d, 2> middles{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
    std::array<int, 2> counts{0, 0};
    Eigen::Vector2d up = Eigen::Vector2d::Zero();
    for (const MarkerObservation& marker : photograph.seen.markers) {
      if (marker.status != MarkerStatus::ok) continue;
      const bool in_a = std::ranges::find(a, marker.id) != a.end();
      if (!in_a && std::ranges::find(b, marker.id) == b.end()) continue;
      const auto& px = marker.corners_px;
      middles[in_a ? 0 : 1] += 0.25 * (px[0] + px[1] + px[2] + px[3]);
      ++counts[in_a ? 0 : 1];
      up += (px[0] + px[1] - px[2] - px[3]).normalized();
    }
    if (counts[0] == 0 || counts[1] == 0) continue;
    const Eigen::Vector2d apart = middles[0] / counts[0] - middles[1] / counts[1];
    if (up.norm() < 0.5 * (counts[0] + counts[1]) || std::abs(apart.dot(up)) < 0.5 * apart.norm() * up.norm())
      continue;  // stickers glued in all directions, or side by side
    (apart.dot(up) > 0 ? above : below) += 1;
  }
  if (above + below == 0 || std::min(above, below) * 4 > above + below) return std::nullopt;
  return above > below;
}

}  // namespace hexcal
