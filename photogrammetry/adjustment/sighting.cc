#include "photogrammetry/adjustment/sighting.h"

#include <Eigen/Cholesky>
#include <map>

namespace hexcal {
namespace {

constexpr std::array<double, 4> kU{-1, 1, 1, -1};
constexpr std::array<double, 4> kV{1, 1, -1, -1};

// Keeps a whitener finite where a detector claims an exact corner.
constexpr double kFloorPx2 = 1e-10;
constexpr double kNearestMm = 1e-3;

}  // namespace

bool whiten(Sighting& sighting) {
  std::array<int, 8> index{};
  int rows = 0;
  for (int c = 0; c < 4; ++c) {
    if (!sighting.corner_used[static_cast<std::size_t>(c)]) continue;
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
  for (std::size_t m = 0; m < network.markers.size(); ++m)
    index_of[network.markers[m].id] = static_cast<int>(m);
  std::vector<Sighting> sightings;
  std::vector<int> views(network.markers.size(), 0);
  for (std::size_t p = 0; p < network.photos.size(); ++p) {
    std::map<int, int> times;
    for (const MarkerObservation& seen : network.photos[p].markers) ++times[seen.id];
    for (const MarkerObservation& seen : network.photos[p].markers) {
      Sighting sighting;
      sighting.photo = static_cast<int>(p);
      for (int c = 0; c < 4; ++c)
        sighting.px.segment<2>(2 * c) = seen.corners_px[static_cast<std::size_t>(c)];
      sighting.covariance_px2 = seen.covariance_px2;
      sighting.side_px = seen.side_px;
      const auto known = index_of.find(seen.id);
      if (known == index_of.end()) {
        sighting.status = SightingStatus::unknown_id;
      } else {
        sighting.marker = known->second;
        if (times[seen.id] > 1) sighting.status = SightingStatus::repeated_id;
        if (seen.status != MarkerStatus::ok || !sighting.px.allFinite() || !whiten(sighting)) {
          sighting.status = SightingStatus::not_measured;
        }
      }
      if (sighting.status == SightingStatus::used) ++views[static_cast<std::size_t>(sighting.marker)];
      sightings.push_back(sighting);
    }
  }
  for (Sighting& sighting : sightings) {
    if (sighting.status == SightingStatus::used && views[static_cast<std::size_t>(sighting.marker)] < 2) {
      sighting.status = SightingStatus::seen_once;
    }
  }
  return sightings;
}

Eigen::Vector3d corner_in_marker(int corner, double edge_mm, const SquareShape& shape_mm) {
  const double u = kU[static_cast<std::size_t>(corner)];
  const double v = kV[static_cast<std::size_t>(corner)];
  const double h = 0.5 * edge_mm;
  return {u * (h + shape_mm[0]) + v * shape_mm[2] + u * v * shape_mm[3],
          v * (h + shape_mm[1]) + u * shape_mm[2] + u * v * shape_mm[4], u * v * shape_mm[5]};
}

Eigen::Matrix<double, 3, 4> marker_corners_in_body(const Network& network, const NetworkGeometry& geometry,
                                                   int marker) {
  const auto m = static_cast<std::size_t>(marker);
  Eigen::Matrix<double, 3, 4> corners;
  for (int c = 0; c < 4; ++c) {
    corners.col(c) =
        geometry.body_from_marker[m] *
        corner_in_marker(c, network.markers[m].size_mm * (1 + geometry.print_scale), geometry.shape_mm[m]);
  }
  return corners;
}

MarkerView view_of(const Network& network, const NetworkGeometry& geometry, const Sighting& sighting) {
  const auto p = static_cast<std::size_t>(sighting.photo);
  const auto m = static_cast<std::size_t>(sighting.marker);
  const NetworkPhoto& photo = network.photos[p];
  return {geometry.cameras[static_cast<std::size_t>(photo.camera)], geometry.camera_from_fixed[p],
          network.markers[m].body == Body::moving
              ? &geometry.fixed_from_moving[static_cast<std::size_t>(photo.epoch)]
              : nullptr,
          geometry.body_from_marker[m]};
}

bool project_marker(const MarkerView& view, double size_mm, double print_scale, const SquareShape& shape_mm,
                    Vector8d& px, SightingJacobian* jacobian) {
  const Eigen::Matrix3d camera_fixed = view.camera_from_fixed.rotation_matrix();
  const Eigen::Matrix3d fixed_moving = view.fixed_from_moving != nullptr
                                           ? view.fixed_from_moving->rotation_matrix()
                                           : Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d body_marker = view.body_from_marker.rotation_matrix();
  if (jacobian != nullptr) jacobian->interior.resize(8, view.camera.parameters.size());
  for (int c = 0; c < 4; ++c) {
    const double u = kU[static_cast<std::size_t>(c)];
    const double v = kV[static_cast<std::size_t>(c)];
    const Eigen::Vector3d turned_in_body =
        body_marker * corner_in_marker(c, size_mm * (1 + print_scale), shape_mm);
    const Eigen::Vector3d in_body = turned_in_body + view.body_from_marker.translation;
    const Eigen::Vector3d turned_in_fixed = fixed_moving * in_body;
    const Eigen::Vector3d in_fixed =
        view.fixed_from_moving != nullptr
            ? Eigen::Vector3d(turned_in_fixed + view.fixed_from_moving->translation)
            : turned_in_fixed;
    const Eigen::Vector3d turned_in_camera = camera_fixed * in_fixed;
    const Eigen::Vector3d x = turned_in_camera + view.camera_from_fixed.translation;
    if (x.z() < kNearestMm) return false;
    const Eigen::Vector2d normalised = x.head<2>() / x.z();
    if (jacobian == nullptr) {
      px.segment<2>(2 * c) = view.camera.image_from_normalised(normalised);
      continue;
    }
    Eigen::Matrix2d by_normalised;
    CameraModel::ByParameters by_parameters;
    px.segment<2>(2 * c) = view.camera.image_from_normalised(normalised, &by_normalised, &by_parameters);
    Eigen::Matrix<double, 2, 3> perspective;
    perspective << 1, 0, -normalised.x(), 0, 1, -normalised.y();
    // By the point in the frames of the camera, the fixed body, the body and the marker.
    const Eigen::Matrix<double, 2, 3> by_camera = by_normalised * perspective / x.z();
    const Eigen::Matrix<double, 2, 3> by_fixed = by_camera * camera_fixed;
    const Eigen::Matrix<double, 2, 3> by_body = by_fixed * fixed_moving;
    const Eigen::Matrix<double, 2, 3> by_marker = by_body * body_marker;
    jacobian->photo.block<2, 6>(2 * c, 0) << by_camera, -by_camera * skew(turned_in_camera);
    jacobian->epoch.block<2, 6>(2 * c, 0) << by_fixed, -by_fixed * skew(turned_in_fixed);
    jacobian->marker.block<2, 6>(2 * c, 0) << by_body, -by_body * skew(turned_in_body);
    jacobian->shape.block<2, 6>(2 * c, 0) << u * by_marker.col(0), v * by_marker.col(1),
        v * by_marker.col(0) + u * by_marker.col(1), u * v * by_marker.col(0), u * v * by_marker.col(1),
        u * v * by_marker.col(2);
    jacobian->print_scale.segment<2>(2 * c) = 0.5 * size_mm * (u * by_marker.col(0) + v * by_marker.col(1));
    jacobian->interior.middleRows<2>(2 * c) = by_parameters;
  }
  return true;
}

}  // namespace hexcal
