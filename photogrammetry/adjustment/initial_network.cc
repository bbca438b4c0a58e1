#include "photogrammetry/adjustment/initial_network.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <map>

#include "photogrammetry/adjustment/rigid_assembly.h"

namespace hexcal {
namespace {

constexpr std::size_t kMaxCandidatesPerEdge = 6;

class NetworkStart {
 public:
  NetworkStart(const Network& network, std::vector<Sighting>& sightings, const NetworkGeometry* map)
      : network_(network), sightings_(sightings), map_(map) {
    const std::size_t num_photos = network.photos.size();
    const std::size_t num_features = network.features.size();
    for (const NetworkCamera& camera : network.cameras) geometry_.cameras.push_back(camera.model);
    geometry_.camera_from_reference.resize(num_photos);
    geometry_.has_photo.assign(num_photos, 0);
    geometry_.body_from_feature.resize(num_features);
    geometry_.has_feature.assign(num_features, 0);
    geometry_.shape = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(network.shapes.size()));
    const auto num_epochs = static_cast<std::size_t>(network.num_epochs);
    geometry_.reference_from_body.resize(static_cast<std::size_t>(network.num_bodies));
    geometry_.has_pose.resize(static_cast<std::size_t>(network.num_bodies));
    for (std::size_t b = kReferenceBody + 1; b < geometry_.has_pose.size(); ++b) {
      geometry_.reference_from_body[b].resize(num_epochs);
      geometry_.has_pose[b].assign(num_epochs, 0);
    }
    for (std::size_t f = 0; f < num_features; ++f) {
      if (!network.features[f].body_from_feature) continue;
      geometry_.body_from_feature[f] = *network.features[f].body_from_feature;
      geometry_.has_feature[f] = 1;
    }
  }

  NetworkGeometry run() {
    find_planar_poses();
    orient_stations();
    for (int body = kReferenceBody + 1; body < network_.num_bodies; ++body) place_body(body);
    orient_by_moving_bodies();
    if (map_ != nullptr) {
      geometry_.cameras = map_->cameras;
      geometry_.shape = map_->shape;
      geometry_.print_scale = map_->print_scale;
      take_points_of_map();
    } else {
      intersect_points();
    }
    mark_unoriented();
    return std::move(geometry_);
  }

 private:
  [[nodiscard]] const NetworkPhoto& photo_of(const Sighting& sighting) const {
    return network_.photos[static_cast<std::size_t>(sighting.photo)];
  }
  [[nodiscard]] const NetworkFeature& feature_of(const Sighting& sighting) const {
    return network_.features[static_cast<std::size_t>(sighting.feature)];
  }
  [[nodiscard]] const CameraModel& camera_of(const Sighting& sighting) const {
    return network_.cameras[static_cast<std::size_t>(photo_of(sighting).camera)].model;
  }

  void find_planar_poses() {
    poses_.resize(sightings_.size());
    for (std::size_t s = 0; s < sightings_.size(); ++s) {
      if (sightings_[s].status != SightingStatus::used) continue;
      if (sightings_[s].points != 4) continue;
      poses_[s] = planar_marker_poses(camera_of(sightings_[s]), sightings_[s].px, feature_of(sightings_[s]));
    }
  }

  void add_view(std::size_t s, const Rigid3& camera_from_frame, AssemblyEdge& edge) const {
    const Sighting& sighting = sightings_[s];
    edge.marker = sighting.feature;
    edge.feature = &feature_of(sighting);
    edge.views.push_back({&sighting, &camera_of(sighting), camera_from_frame});
    for (const PlanarPose& pose : poses_[s]) {
      if (edge.candidates.size() < kMaxCandidatesPerEdge) {
        edge.candidates.push_back(inverse(camera_from_frame) * pose.camera_from_marker);
      }
    }
  }

  // Frames by the body's known features, where there are any; otherwise the body is put together anew.
  Assembly assemble(std::map<std::pair<int, int>, AssemblyEdge> by_frame, int num_frames, int body) const {
    std::vector<AssemblyEdge> edges;
    for (auto& [key, edge] : by_frame) edges.push_back(std::move(edge));
    if (map_ != nullptr) return orient_frames(edges, num_frames, map_->body_from_feature, map_->has_feature);
    const bool known =
        std::any_of(network_.features.begin(), network_.features.end(),
                    [&](const NetworkFeature& f) { return f.body == body && f.body_from_feature; });
    if (known) return orient_frames(edges, num_frames, geometry_.body_from_feature, geometry_.has_feature);
    return assemble_body(std::move(edges), num_frames, static_cast<int>(network_.features.size()));
  }

  void take_features(const Assembly& assembly, int body, const Rigid3& body_from_assembly) {
    for (std::size_t f = 0; f < network_.features.size(); ++f) {
      if (network_.features[f].body != body || network_.features[f].body_from_feature) continue;
      geometry_.body_from_feature[f] = body_from_assembly * assembly.body_from_marker[f];
      geometry_.has_feature[f] = assembly.has_marker[f];
    }
  }

  // Stations from squares of the reference body. A frame is a photograph with a station of its own, or a
  // shared station.
  void orient_stations() {
    const int num_photos = static_cast<int>(network_.photos.size());
    const auto frame_of = [&](int photo) {
      const int station = network_.photos[static_cast<std::size_t>(photo)].station;
      return station < 0 ? photo : num_photos + station;
    };
    std::map<std::pair<int, int>, AssemblyEdge> edges;
    for (std::size_t s = 0; s < sightings_.size(); ++s) {
      const Sighting& sighting = sightings_[s];
      if (sighting.status != SightingStatus::used || feature_of(sighting).body != kReferenceBody) continue;
      if (sighting.points < 3) continue;
      AssemblyEdge& edge = edges[{frame_of(sighting.photo), sighting.feature}];
      edge.frame = frame_of(sighting.photo);
      add_view(s, Rigid3(), edge);
    }
    const Assembly assembly =
        assemble(std::move(edges), num_photos + static_cast<int>(network_.stations.size()), kReferenceBody);
    // Stations that are known say where the world is.
    Rigid3 world_from_assembly;
    for (std::size_t k = 0; k < network_.stations.size(); ++k) {
      const auto frame = static_cast<std::size_t>(num_photos) + k;
      if (!network_.stations[k].camera_from_reference || !assembly.has_frame[frame]) continue;
      world_from_assembly =
          inverse(*network_.stations[k].camera_from_reference) * assembly.frame_from_body[frame];
      break;
    }
    take_features(assembly, kReferenceBody, world_from_assembly);
    for (int p = 0; p < num_photos; ++p) {
      const auto i = static_cast<std::size_t>(p);
      const auto frame = static_cast<std::size_t>(frame_of(p));
      const int station = network_.photos[i].station;
      if (station >= 0 && network_.stations[static_cast<std::size_t>(station)].camera_from_reference) {
        geometry_.camera_from_reference[i] =
            *network_.stations[static_cast<std::size_t>(station)].camera_from_reference;
        geometry_.has_photo[i] = 1;
      } else if (assembly.has_frame[frame]) {
        geometry_.camera_from_reference[i] = assembly.frame_from_body[frame] * inverse(world_from_assembly);
        geometry_.has_photo[i] = 1;
      }
    }
  }

  // A moving body over the epochs, from photographs whose stations are known.
  void place_body(int body) {
    const auto b = static_cast<std::size_t>(body);
    std::map<std::pair<int, int>, AssemblyEdge> edges;
    for (std::size_t s = 0; s < sightings_.size(); ++s) {
      const Sighting& sighting = sightings_[s];
      if (sighting.status != SightingStatus::used || feature_of(sighting).body != body) continue;
      if (sighting.points < 3 || !geometry_.has_photo[static_cast<std::size_t>(sighting.photo)]) continue;
      const int epoch = photo_of(sighting).epoch;
      AssemblyEdge& edge = edges[{epoch, sighting.feature}];
      edge.frame = epoch;
      add_view(s, geometry_.camera_from_reference[static_cast<std::size_t>(sighting.photo)], edge);
    }
    const Assembly assembly = assemble(std::move(edges), network_.num_epochs, body);
    geometry_.reference_from_body[b] = assembly.frame_from_body;
    geometry_.has_pose[b] = assembly.has_frame;
    take_features(assembly, body, Rigid3());
  }

  // Photographs without squares of the reference body, by a moving body whose pose others have given.
  void orient_by_moving_bodies() {
    std::map<std::pair<int, int>, std::vector<AssemblyEdge>> of_photo;
    for (std::size_t s = 0; s < sightings_.size(); ++s) {
      const Sighting& sighting = sightings_[s];
      const auto p = static_cast<std::size_t>(sighting.photo);
      if (sighting.status != SightingStatus::used || geometry_.has_photo[p] || sighting.points < 3) continue;
      const int body = feature_of(sighting).body;
      if (body == kReferenceBody || !geometry_.has_feature[static_cast<std::size_t>(sighting.feature)])
        continue;
      if (network_.photos[p].station >= 0 || !geometry_.has_body(body, network_.photos[p].epoch)) continue;
      AssemblyEdge edge;
      add_view(s, Rigid3(), edge);
      if (!edge.candidates.empty()) of_photo[{sighting.photo, body}].push_back(edge);
    }
    for (const auto& [key, edges] : of_photo) {
      const auto p = static_cast<std::size_t>(key.first);
      if (geometry_.has_photo[p]) continue;
      std::vector<const AssemblyEdge*> pointers;
      for (const AssemblyEdge& edge : edges) pointers.push_back(&edge);
      Rigid3 camera_from_body;
      if (!orient_frame(pointers, geometry_.body_from_feature, camera_from_body)) continue;
      const auto epoch = static_cast<std::size_t>(network_.photos[p].epoch);
      geometry_.camera_from_reference[p] =
          camera_from_body *
          inverse(geometry_.reference_from_body[static_cast<std::size_t>(key.second)][epoch]);
      geometry_.has_photo[p] = 1;
    }
  }

  void take_points_of_map() {
    for (std::size_t f = 0; f < network_.features.size(); ++f) {
      if (network_.features[f].points() >= 3) continue;
      geometry_.body_from_feature[f] = map_->body_from_feature[f];
      geometry_.has_feature[f] = map_->has_feature[f];
    }
  }

  // Single points in their body's frame: the point nearest to all lines of sight (least squares of the
  // distances; Foerstner and Wrobel 2016, section 13.4.1).
  void intersect_points() {
    struct Lines {
      Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
      Eigen::Vector3d right = Eigen::Vector3d::Zero();
    };
    std::map<int, Lines> lines;
    for (const Sighting& sighting : sightings_) {
      if (sighting.status != SightingStatus::used || sighting.points != 1) continue;
      const NetworkFeature& feature = feature_of(sighting);
      const auto p = static_cast<std::size_t>(sighting.photo);
      const NetworkPhoto& photo = network_.photos[p];
      if (feature.body_from_feature || !geometry_.has_photo[p]) continue;
      if (!geometry_.has_body(feature.body, photo.epoch)) continue;
      const auto ray = camera_of(sighting).normalised_from_image(sighting.px.head<2>());
      if (!ray) continue;
      Rigid3 camera_from_body = geometry_.camera_from_reference[p];
      if (feature.body != kReferenceBody) {
        camera_from_body =
            camera_from_body * geometry_.reference_from_body[static_cast<std::size_t>(feature.body)]
                                                            [static_cast<std::size_t>(photo.epoch)];
      }
      const Rigid3 body_from_camera = inverse(camera_from_body);
      const Eigen::Vector3d along = body_from_camera.rotation * ray->homogeneous().normalized();
      const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - along * along.transpose();
      lines[sighting.feature].normal += across;
      lines[sighting.feature].right += across * body_from_camera.translation;
    }
    for (const auto& [f, sum] : lines) {
      const Eigen::LDLT<Eigen::Matrix3d> ldlt(sum.normal);
      if (!(ldlt.vectorD().minCoeff() > kLeastIntersection)) continue;
      const auto i = static_cast<std::size_t>(f);
      geometry_.body_from_feature[i] = Rigid3::from_translation(ldlt.solve(sum.right));
      geometry_.has_feature[i] = 1;
    }
  }

  void mark_unoriented() {
    for (Sighting& sighting : sightings_) {
      if (sighting.status != SightingStatus::used) continue;
      if (!geometry_.has_photo[static_cast<std::size_t>(sighting.photo)] ||
          !geometry_.has_feature[static_cast<std::size_t>(sighting.feature)] ||
          !geometry_.has_body(feature_of(sighting).body, photo_of(sighting).epoch)) {
        sighting.status = SightingStatus::unoriented;
      }
    }
  }

  static constexpr double kLeastIntersection = 1e-4;  // squared sine of the angle between lines, about

  const Network& network_;
  std::vector<Sighting>& sightings_;
  const NetworkGeometry* map_;
  std::vector<std::vector<PlanarPose>> poses_;
  NetworkGeometry geometry_;
};

}  // namespace

NetworkGeometry initial_network(const Network& network, std::vector<Sighting>& sightings,
                                const NetworkGeometry* map) {
  return NetworkStart(network, sightings, map).run();
}

}  // namespace hexcal
