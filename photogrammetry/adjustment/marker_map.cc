#include "photogrammetry/adjustment/marker_map.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "photogrammetry/adjustment/adjustment_errors.h"
#include "photogrammetry/adjustment/adjustment_stages.h"
#include "photogrammetry/adjustment/adjustment_statistics.h"
#include "photogrammetry/adjustment/initial_network.h"

namespace hexcal {
namespace {

// The network with the observations of some epochs only; photographs and epochs keep their numbers.
Network with_epochs(const Network& network, const std::vector<char>& chosen) {
  Network part = network;
  for (NetworkPhoto& photo : part.photos) {
    if (!chosen[static_cast<std::size_t>(photo.epoch)]) photo.observations.clear();
  }
  return part;
}

// What belongs to one epoch: indices of the whole network's photographs and sightings.
struct EpochMembers {
  std::vector<int> photos;
  std::vector<std::size_t> sightings;
};

// One epoch as a network of its own, with the map's cameras and features; `covariance` is that of the common
// parameters.
AdjustmentStage start_on_map(const Network& alone, const EpochMembers& members,
                             const std::vector<Sighting>& sightings, const AdjustmentResult& map,
                             const Eigen::MatrixXd& covariance) {
  AdjustmentStage stage;
  for (const std::size_t s : members.sightings) {
    stage.sightings.push_back(sightings[s]);
    const auto local = std::find(members.photos.begin(), members.photos.end(), sightings[s].photo);
    stage.sightings.back().photo = static_cast<int>(local - members.photos.begin());
  }
  stage.geometry = initial_network(alone, stage.sightings, &map.geometry);
  stage.layout = map.errors->layout;
  stage.covariance = covariance;
  stage.settings.data_variance = map.sigma0 * map.sigma0;
  stage.settings.common_moves = false;
  stage.settings.converged = 1e-6;  // a thousandth of a standard deviation
  return stage;
}

// Geometry, covariances and the sightings' fates of an adjusted epoch into the whole.
void put_epoch(const EpochMembers& members, std::size_t epoch, AdjustmentStage& stage,
               std::vector<Sighting>& sightings, AdjustmentResult& result, ResultErrors& errors) {
  for (std::size_t i = 0; i < members.sightings.size(); ++i) {
    Sighting& whole = sightings[members.sightings[i]];
    const int photo = whole.photo;
    whole = stage.sightings[i];
    whole.photo = photo;
  }
  for (std::size_t i = 0; i < members.photos.size(); ++i) {
    const auto p = static_cast<std::size_t>(members.photos[i]);
    result.geometry.camera_from_reference[p] = stage.geometry.camera_from_reference[i];
    result.geometry.has_photo[p] = stage.geometry.has_photo[i];
  }
  for (std::size_t b = kReferenceBody + 1; b < stage.geometry.has_pose.size(); ++b) {
    result.geometry.reference_from_body[b][epoch] = stage.geometry.reference_from_body[b][0];
    result.geometry.has_pose[b][epoch] = stage.geometry.has_pose[b][0];
  }
  if (!stage.system) return;
  EpochElimination& elimination = stage.system->epochs[0];
  for (StationElimination& station : elimination.stations) {
    station.photo = members.photos[static_cast<std::size_t>(station.photo)];
  }
  add_epoch_errors(elimination, epoch, errors);
}

}  // namespace

AdjustmentResult adjust_network_by_map(const Network& network, const std::vector<int>& map_epochs,
                                       const AdjustmentOptions& options) {
  const auto num_epochs = static_cast<std::size_t>(network.num_epochs);
  std::vector<char> in_map(num_epochs, 0);
  for (const int epoch : map_epochs) in_map[static_cast<std::size_t>(epoch)] = 1;
  AdjustmentResult result = adjust_network(with_epochs(network, in_map), options);
  if (result.status == AdjustmentStatus::nothing_connected) return result;

  std::vector<Sighting> sightings = collect_sightings(network);
  std::vector<SightingTest> tests(sightings.size());
  std::vector<EpochMembers> members(num_epochs);
  for (std::size_t p = 0; p < network.photos.size(); ++p) {
    members[static_cast<std::size_t>(network.photos[p].epoch)].photos.push_back(static_cast<int>(p));
  }
  std::size_t of_map = 0;
  for (std::size_t s = 0; s < sightings.size(); ++s) {
    const auto e =
        static_cast<std::size_t>(network.photos[static_cast<std::size_t>(sightings[s].photo)].epoch);
    if (in_map[e]) {
      tests[s].redundancy = result.redundancy[of_map];
      sightings[s] = result.sightings[of_map++];
    } else {
      members[e].sightings.push_back(s);
    }
  }
  ResultErrors errors = *result.errors;
  const Eigen::MatrixXd covariance = errors.root * errors.root.transpose();
  // Stations of the map are known; those that it did not orient stay open.
  std::vector<NetworkStation> stations = network.stations;
  for (std::size_t p = 0; p < network.photos.size(); ++p) {
    const int station = network.photos[p].station;
    if (station >= 0 && result.geometry.has_photo[p])
      stations[static_cast<std::size_t>(station)].camera_from_reference =
          result.geometry.camera_from_reference[p];
  }
  std::vector<double> redundancy(num_epochs, 0);
  std::vector<char> failed(num_epochs, 0);
  tbb::parallel_for(std::size_t{0}, num_epochs, [&](std::size_t e) {
    if (in_map[e] || members[e].sightings.empty()) return;
    Network alone{network.cameras, network.features, network.shapes, stations, {}, 1, network.num_bodies, {}};
    for (const int p : members[e].photos) {
      const NetworkPhoto& photo = network.photos[static_cast<std::size_t>(p)];
      alone.photos.push_back({photo.camera, 0, photo.station, {}});
    }
    const AdjustmentJob job{alone, options};
    AdjustmentStage stage = start_on_map(alone, members[e], sightings, result, covariance);
    drop_unsupported(job, stage);
    if (std::find(stage.geometry.has_photo.begin(), stage.geometry.has_photo.end(), 1) !=
        stage.geometry.has_photo.end()) {
      reject_outliers(job, stage, solve_robustly(job, stage));
      solve(job, stage);
      analyse(job, stage);
      const std::vector<SightingTest> of_epoch = test_stage(job, stage);
      for (std::size_t i = 0; i < of_epoch.size(); ++i) tests[members[e].sightings[i]] = of_epoch[i];
      drop_unsupported(job, stage);
      redundancy[e] = stage.redundancy;
      failed[e] = stage.converged ? 0 : 1;
    }
    put_epoch(members[e], e, stage, sightings, result, errors);
  });
  result.errors = std::make_shared<const ResultErrors>(std::move(errors));
  for (const double r : redundancy) result.redundancy_total += r;
  result.sightings = std::move(sightings);
  summarise_residuals(network, tests, result);
  const auto num_failed = std::count(failed.begin(), failed.end(), 1);
  if (result.status == AdjustmentStatus::ok && num_failed > 0) {
    result.status = AdjustmentStatus::not_converged;
    result.reason = fmt::format("{} poses did not converge on the map of the markers", num_failed);
  }
  return result;
}

}  // namespace hexcal
