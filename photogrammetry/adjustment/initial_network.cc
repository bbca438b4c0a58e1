#include "photogrammetry/adjustment/initial_network.h"

#include <algorithm>
#include <map>

#include "photogrammetry/adjustment/rigid_assembly.h"

namespace hexcal {
namespace {

constexpr std::size_t kMaxCandidatesPerEdge = 6;

AssemblyView view_from(const Network& network, const Sighting& sighting, const Rigid3& camera_from_frame) {
  const NetworkPhoto& photo = network.photos[static_cast<std::size_t>(sighting.photo)];
  return {&sighting, &network.cameras[static_cast<std::size_t>(photo.camera)].model, camera_from_frame};
}

void add_view(const Network& network, const Sighting& sighting, const std::vector<PlanarPose>& poses,
              const Rigid3& camera_from_frame, AssemblyEdge& edge) {
  edge.marker = sighting.marker;
  edge.size_mm = network.markers[static_cast<std::size_t>(sighting.marker)].size_mm;
  edge.views.push_back(view_from(network, sighting, camera_from_frame));
  for (const PlanarPose& pose : poses) {
    if (edge.candidates.size() < kMaxCandidatesPerEdge) {
      edge.candidates.push_back(inverse(camera_from_frame) * pose.camera_from_marker);
    }
  }
}

// Photographs without fixed markers, by the moving body of an epoch that others have oriented.
void orient_by_moving_body(const Network& network, const std::vector<Sighting>& sightings,
                           const std::vector<std::vector<PlanarPose>>& poses, NetworkGeometry& geometry) {
  std::map<int, std::vector<AssemblyEdge>> of_photo;
  for (std::size_t s = 0; s < sightings.size(); ++s) {
    const Sighting& sighting = sightings[s];
    const auto p = static_cast<std::size_t>(sighting.photo);
    if (sighting.status != SightingStatus::used || geometry.has_photo[p]) continue;
    const auto m = static_cast<std::size_t>(sighting.marker);
    if (network.markers[m].body != Body::moving || !geometry.has_marker[m]) continue;
    if (!geometry.has_epoch[static_cast<std::size_t>(network.photos[p].epoch)]) continue;
    AssemblyEdge edge;
    add_view(network, sighting, poses[s], Rigid3(), edge);
    if (!edge.candidates.empty()) of_photo[sighting.photo].push_back(edge);
  }
  for (const auto& [photo, edges] : of_photo) {
    const auto p = static_cast<std::size_t>(photo);
    std::vector<const AssemblyEdge*> pointers;
    for (const AssemblyEdge& edge : edges) pointers.push_back(&edge);
    Rigid3 camera_from_moving;
    if (!orient_frame(pointers, geometry.body_from_marker, camera_from_moving)) continue;
    const auto epoch = static_cast<std::size_t>(network.photos[p].epoch);
    geometry.camera_from_fixed[p] = camera_from_moving * inverse(geometry.fixed_from_moving[epoch]);
    geometry.has_photo[p] = 1;
  }
}

}  // namespace

NetworkGeometry initial_network(const Network& network, std::vector<Sighting>& sightings,
                                const NetworkGeometry* map) {
  const int num_photos = static_cast<int>(network.photos.size());
  const int num_markers = static_cast<int>(network.markers.size());
  NetworkGeometry geometry;
  for (const NetworkCamera& camera : network.cameras) geometry.cameras.push_back(camera.model);
  geometry.shape_mm.assign(network.markers.size(), SquareShape::Zero());

  std::vector<std::vector<PlanarPose>> poses(sightings.size());
  std::vector<AssemblyEdge> edges;
  for (std::size_t s = 0; s < sightings.size(); ++s) {
    const Sighting& sighting = sightings[s];
    if (sighting.status != SightingStatus::used) continue;
    const NetworkMarker& marker = network.markers[static_cast<std::size_t>(sighting.marker)];
    const NetworkPhoto& photo = network.photos[static_cast<std::size_t>(sighting.photo)];
    poses[s] = planar_marker_poses(network.cameras[static_cast<std::size_t>(photo.camera)].model, sighting.px,
                                   marker.size_mm);
    if (marker.body != Body::fixed) continue;
    AssemblyEdge edge;
    edge.frame = sighting.photo;
    add_view(network, sighting, poses[s], Rigid3(), edge);
    edges.push_back(edge);
  }
  const auto assemble = [&](std::vector<AssemblyEdge> of_body, int num_frames) {
    return map != nullptr ? orient_frames(of_body, num_frames, map->body_from_marker, map->has_marker)
                          : assemble_body(std::move(of_body), num_frames, num_markers);
  };
  const Assembly fixed = assemble(std::move(edges), num_photos);
  geometry.camera_from_fixed = fixed.frame_from_body;
  geometry.has_photo = fixed.has_frame;
  geometry.body_from_marker = fixed.body_from_marker;
  geometry.has_marker = fixed.has_marker;

  std::map<std::pair<int, int>, AssemblyEdge> by_epoch;
  for (std::size_t s = 0; s < sightings.size(); ++s) {
    const Sighting& sighting = sightings[s];
    if (sighting.status != SightingStatus::used) continue;
    if (network.markers[static_cast<std::size_t>(sighting.marker)].body != Body::moving) continue;
    if (!geometry.has_photo[static_cast<std::size_t>(sighting.photo)]) continue;
    const int epoch = network.photos[static_cast<std::size_t>(sighting.photo)].epoch;
    AssemblyEdge& edge = by_epoch[{epoch, sighting.marker}];
    edge.frame = epoch;
    add_view(network, sighting, poses[s],
             geometry.camera_from_fixed[static_cast<std::size_t>(sighting.photo)], edge);
  }
  std::vector<AssemblyEdge> moving_edges;
  for (auto& [key, edge] : by_epoch) moving_edges.push_back(std::move(edge));
  const Assembly moving = assemble(std::move(moving_edges), network.num_epochs);
  geometry.fixed_from_moving = moving.frame_from_body;
  geometry.has_epoch = moving.has_frame;
  for (std::size_t m = 0; m < network.markers.size(); ++m) {
    if (network.markers[m].body != Body::moving) continue;
    geometry.body_from_marker[m] = moving.body_from_marker[m];
    geometry.has_marker[m] = moving.has_marker[m];
  }
  orient_by_moving_body(network, sightings, poses, geometry);

  if (map != nullptr) {
    geometry.cameras = map->cameras;
    geometry.shape_mm = map->shape_mm;
    geometry.print_scale = map->print_scale;
  }

  for (Sighting& sighting : sightings) {
    if (sighting.status != SightingStatus::used) continue;
    const auto p = static_cast<std::size_t>(sighting.photo);
    const auto m = static_cast<std::size_t>(sighting.marker);
    const bool epoch_known = network.markers[m].body == Body::fixed ||
                             geometry.has_epoch[static_cast<std::size_t>(network.photos[p].epoch)];
    if (!geometry.has_photo[p] || !geometry.has_marker[m] || !epoch_known) {
      sighting.status = SightingStatus::unoriented;
    }
  }
  return geometry;
}

}  // namespace hexcal
