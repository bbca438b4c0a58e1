#include "photogrammetry/adjustment/bundle_system.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>

#include "kinematics/geometry/covariance.h"

// The normal equations of a bundle adjustment are sparse: stations of one photograph meet no other, poses of
// one epoch no others (Triggs et al. 2000, section 6; Brown 1958). Both are eliminated in closed form, which
// costs time in proportion to the photographs and gives the covariances of all poses on the way.

namespace hexcal {
namespace {

constexpr std::size_t kSums = 16;  // partial sums, whatever the threads: fixes their order

// Contribution of an epoch to the reduced normal equations, in its own columns; lower triangle.
struct ReducedEpoch {
  Eigen::MatrixXd normal;
  Eigen::VectorXd right;
};

// Inverse of a damped diagonal block; a block without information becomes zero and its unknowns stay.
template <typename Matrix>
Matrix invert_block(Matrix block, double damping) {
  block.diagonal() *= 1 + damping;
  const Eigen::LDLT<Matrix> ldlt(block);
  const Matrix zero = Matrix::Zero(block.rows(), block.cols());
  if (ldlt.info() != Eigen::Success || !ldlt.isPositive()) return zero;
  const Matrix inverse = ldlt.solve(Matrix::Identity(block.rows(), block.cols()));
  return inverse.allFinite() ? Matrix(0.5 * (inverse + inverse.transpose())) : zero;
}

// What the used sightings of an epoch touch.
void find_touched(const Network& network, const std::vector<Sighting>& sightings,
                  const std::vector<std::size_t>& members, const std::vector<double>& weights,
                  const BundleLayout& layout, EpochElimination& epoch) {
  std::vector<char> touched(static_cast<std::size_t>(layout.size), 0);
  std::vector<char> features(network.features.size(), 0);
  std::vector<char> bodies(static_cast<std::size_t>(network.num_bodies), 0);
  const auto touch = [&](int first, Eigen::Index count) {
    for (Eigen::Index i = 0; first >= 0 && i < count; ++i) touched[static_cast<std::size_t>(first + i)] = 1;
  };
  int photo = -1;
  for (const std::size_t s : members) {
    if (weights[s] == 0) continue;
    if (sightings[s].photo != photo) {
      photo = sightings[s].photo;
      const NetworkPhoto& of = network.photos[static_cast<std::size_t>(photo)];
      const auto c = static_cast<std::size_t>(of.camera);
      touch(layout.interior[c], layout.interior_basis[c].cols());
      if (of.station >= 0) touch(layout.station[static_cast<std::size_t>(of.station)], 6);
    }
    const auto f = static_cast<std::size_t>(sightings[s].feature);
    if (features[f]) continue;
    features[f] = 1;
    bodies[static_cast<std::size_t>(network.features[f].body)] = 1;
    for (const int column : feature_columns(network, layout, sightings[s].feature)) touch(column, 1);
  }
  epoch.columns.clear();
  for (int i = 0; i < layout.size; ++i) {
    if (touched[static_cast<std::size_t>(i)]) epoch.columns.push_back(i);
  }
  epoch.bodies.clear();
  for (int b = kReferenceBody + 1; b < network.num_bodies; ++b) {
    if (bodies[static_cast<std::size_t>(b)]) epoch.bodies.push_back(b);
  }
}

struct EpochBlocks {
  std::vector<Matrix6d> station;
  std::vector<Matrix6Xd> station_poses;
  std::vector<Matrix6Xd> station_common;
  std::vector<Vector6d> station_right;
  Eigen::MatrixXd poses;
  Eigen::MatrixXd poses_common;
  Eigen::VectorXd poses_right;
};

// Eliminates the stations, then the poses, leaving the common parameters in `reduced`.
void eliminate(EpochBlocks& blocks, double damping, EpochElimination& epoch, ReducedEpoch& reduced) {
  const auto width = static_cast<Eigen::Index>(epoch.columns.size());
  const Eigen::Index of_stations = 6 * static_cast<Eigen::Index>(epoch.stations.size());
  const Eigen::Index of_poses = blocks.poses.rows();
  // The eliminated blocks one below the other: one product takes them all from the normal equations.
  Eigen::MatrixXd blocks_by_common(of_stations + of_poses, width);
  Eigen::MatrixXd eliminated_by_common(of_stations + of_poses, width);
  for (std::size_t i = 0; i < epoch.stations.size(); ++i) {
    StationElimination& station = epoch.stations[i];
    station.inverse = invert_block(blocks.station[i], damping);
    station.start = station.inverse * blocks.station_right[i];
    station.decrease = station.start.dot(blocks.station_right[i]);
    station.by_poses.noalias() = station.inverse * blocks.station_poses[i];
    station.by_common.noalias() = station.inverse * blocks.station_common[i];
    if (of_poses > 0) {
      blocks.poses.noalias() -= blocks.station_poses[i].transpose() * station.by_poses;
      blocks.poses_right.noalias() -= blocks.station_poses[i].transpose() * station.start;
      blocks.poses_common.noalias() -= blocks.station_poses[i].transpose() * station.by_common;
    }
    reduced.right.noalias() -= blocks.station_common[i].transpose() * station.start;
    if (width == 0) continue;  // all common parameters are held, as on a map of the features
    const auto row = 6 * static_cast<Eigen::Index>(i);
    blocks_by_common.middleRows<6>(row) = blocks.station_common[i];
    eliminated_by_common.middleRows<6>(row) = station.by_common;
  }
  epoch.by_common = Eigen::MatrixXd::Zero(of_poses, width);
  if (of_poses > 0) {
    if (of_poses == 6) {
      epoch.inverse = invert_block(Matrix6d(blocks.poses), damping);
    } else {
      epoch.inverse = invert_block(blocks.poses, damping);
    }
    epoch.start = epoch.inverse * blocks.poses_right;
    epoch.decrease = epoch.start.dot(blocks.poses_right);
    epoch.by_common.noalias() = epoch.inverse * blocks.poses_common;
    reduced.right.noalias() -= blocks.poses_common.transpose() * epoch.start;
    if (width > 0) {
      blocks_by_common.bottomRows(of_poses) = blocks.poses_common;
      eliminated_by_common.bottomRows(of_poses) = epoch.by_common;
    }
  }
  if (of_stations + of_poses > 0 && reduced.normal.size() > 0) {
    reduced.normal.triangularView<Eigen::Lower>() -= blocks_by_common.transpose() * eliminated_by_common;
  }
}

void reduce_epoch(const Network& network, const NetworkGeometry& geometry,
                  const std::vector<Sighting>& sightings, const std::vector<std::size_t>& members,
                  const std::vector<double>& weights, const BundleLayout& layout,
                  const BundleSettings& settings, double damping, EpochElimination& epoch,
                  ReducedEpoch& reduced) {
  find_touched(network, sightings, members, weights, layout, epoch);
  const auto width = static_cast<Eigen::Index>(epoch.columns.size());
  const auto of_poses = 6 * static_cast<Eigen::Index>(epoch.bodies.size());
  std::vector<int> compact(static_cast<std::size_t>(layout.size), -1);
  for (std::size_t i = 0; i < epoch.columns.size(); ++i) {
    compact[static_cast<std::size_t>(epoch.columns[i])] = static_cast<int>(i);
  }
  const Eigen::Index summed = settings.common_moves ? width : 0;
  reduced.normal.setZero(summed, summed);
  reduced.right.setZero(width);
  EpochBlocks blocks;
  blocks.poses = Eigen::MatrixXd::Zero(of_poses, of_poses);
  blocks.poses_common = Eigen::MatrixXd::Zero(of_poses, width);
  blocks.poses_right = Eigen::VectorXd::Zero(of_poses);

  FeatureJacobian jacobian;
  jacobian.with_shape = layout.free_shape;
  CommonJacobian common;
  Vector8d r;
  for (const std::size_t s : members) {
    if (weights[s] == 0) continue;
    const Sighting& sighting = sightings[s];
    if (!whitened_residual(network, geometry, sighting, r, &jacobian)) continue;
    const bool own_station = has_own_station(network, sighting.photo);
    if (own_station && (epoch.stations.empty() || epoch.stations.back().photo != sighting.photo)) {
      epoch.stations.emplace_back();
      epoch.stations.back().photo = sighting.photo;
      blocks.station.push_back(Matrix6d::Zero());
      blocks.station_poses.push_back(Matrix6Xd::Zero(6, of_poses));
      blocks.station_common.push_back(Matrix6Xd::Zero(6, width));
      blocks.station_right.push_back(Vector6d::Zero());
    }
    common_jacobian(network, layout, sighting, jacobian, common);
    const double weight = weights[s] / settings.data_variance;
    const int body = network.features[static_cast<std::size_t>(sighting.feature)].body;
    const bool moving = body != kReferenceBody;
    const Eigen::Index pose_row = moving ? epoch.row_of(body) : 0;
    const Matrix86d js = weight * jacobian.station;
    const Matrix86d jp = weight * jacobian.pose;
    if (own_station) {
      blocks.station.back().noalias() += js.transpose() * jacobian.station;
      blocks.station_right.back().noalias() += js.transpose() * r;
      if (moving) blocks.station_poses.back().middleCols<6>(pose_row) += js.transpose() * jacobian.pose;
    }
    if (moving) {
      blocks.poses.block<6, 6>(pose_row, pose_row) += jp.transpose() * jacobian.pose;
      blocks.poses_right.segment<6>(pose_row) += jp.transpose() * r;
    }
    const Eigen::Index n = common.values.cols();
    using Rows6 = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, CommonJacobian::kMax>;
    const Rows6 sc = js.transpose() * common.values;
    const Rows6 pc = jp.transpose() * common.values;
    const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, CommonJacobian::kMax, CommonJacobian::kMax>
        cc = weight * (common.values.transpose() * common.values);
    const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, CommonJacobian::kMax, 1> cr =
        weight * (common.values.transpose() * r);
    for (Eigen::Index a = 0; a < n; ++a) {
      const int i = compact[static_cast<std::size_t>(common.column[static_cast<std::size_t>(a)])];
      if (own_station) blocks.station_common.back().col(i) += sc.col(a);
      if (moving) blocks.poses_common.block<6, 1>(pose_row, i) += pc.col(a);
      reduced.right[i] += cr[a];
      if (!settings.common_moves) continue;
      for (Eigen::Index b = a; b < n; ++b) {  // the sighting's columns ascend
        reduced.normal(compact[static_cast<std::size_t>(common.column[static_cast<std::size_t>(b)])], i) +=
            cc(b, a);
      }
    }
  }
  eliminate(blocks, damping, epoch, reduced);
}

// Lower triangle of an epoch into that of the whole; the epoch's columns ascend.
void add_scattered(const ReducedEpoch& reduced, const std::vector<int>& columns, ReducedEpoch& sum) {
  for (std::size_t b = 0; b < columns.size(); ++b) {
    const auto col = static_cast<Eigen::Index>(b);
    for (std::size_t a = b; a < columns.size(); ++a) {
      sum.normal(columns[a], columns[b]) += reduced.normal(static_cast<Eigen::Index>(a), col);
    }
    sum.right[columns[b]] += reduced.right[col];
  }
}

}  // namespace

int EpochElimination::row_of(int body) const {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (bodies[i] == body) return 6 * static_cast<int>(i);
  }
  return -1;
}

const StationElimination* EpochElimination::station_of(int photo) const {
  const auto found =
      std::find_if(stations.begin(), stations.end(), [&](const auto& entry) { return entry.photo == photo; });
  return found == stations.end() ? nullptr : &*found;
}

BundleSystem assemble_bundle(const Network& network, const NetworkGeometry& geometry,
                             const std::vector<Sighting>& sightings, const std::vector<double>& weights,
                             const BundleLayout& layout, const BundleSettings& settings, double damping) {
  const auto num_epochs = static_cast<std::size_t>(network.num_epochs);
  std::vector<std::vector<std::size_t>> members(num_epochs);
  for (std::size_t s = 0; s < sightings.size(); ++s) {
    const auto p = static_cast<std::size_t>(sightings[s].photo);
    members[static_cast<std::size_t>(network.photos[p].epoch)].push_back(s);
  }
  BundleSystem system;
  const Eigen::Index summed = settings.common_moves ? layout.size : 0;
  system.normal = Eigen::MatrixXd::Zero(summed, summed);
  system.right = Eigen::VectorXd::Zero(summed);
  system.epochs.resize(num_epochs);
  const std::size_t num_sums = std::min(kSums, num_epochs);
  std::vector<ReducedEpoch> sums(num_sums);
  tbb::parallel_for(std::size_t{0}, num_sums, [&](std::size_t k) {
    ReducedEpoch& sum = sums[k];
    sum.normal.setZero(summed, summed);
    sum.right.setZero(summed);
    ReducedEpoch reduced;
    for (std::size_t e = k; e < num_epochs; e += num_sums) {
      if (members[e].empty()) continue;
      reduce_epoch(network, geometry, sightings, members[e], weights, layout, settings, damping,
                   system.epochs[e], reduced);
      if (settings.common_moves) add_scattered(reduced, system.epochs[e].columns, sum);
    }
  });
  if (!settings.common_moves) return system;
  for (const ReducedEpoch& sum : sums) {
    system.normal += sum.normal;
    system.right += sum.right;
  }
  system.normal.triangularView<Eigen::StrictlyUpper>() = system.normal.transpose();
  add_priors(network, geometry, layout, settings, system.normal, system.right);
  system.normal.diagonal() *= 1 + damping;
  return system;
}

BundleStep solve_bundle(const Network& network, const BundleSystem& system, const BundleLayout& layout,
                        const BundleSettings& settings) {
  BundleStep step;
  step.common = Eigen::VectorXd::Zero(layout.size);
  const Eigen::Index kept = settings.interior_moves ? 0 : layout.num_interior;
  const Eigen::Index n = settings.common_moves ? layout.size - kept : 0;
  if (n > 0) {
    step.common.tail(n) = system.normal.bottomRightCorner(n, n).selfadjointView<Eigen::Lower>().ldlt().solve(
        system.right.tail(n));
    step.predicted_decrease = step.common.dot(system.right);
  }
  step.station.assign(network.photos.size(), Vector6d::Zero());
  step.pose.assign(static_cast<std::size_t>(network.num_bodies),
                   std::vector<Vector6d>(system.epochs.size(), Vector6d::Zero()));
  for (std::size_t e = 0; e < system.epochs.size(); ++e) {
    const EpochElimination& epoch = system.epochs[e];
    Eigen::VectorXd common(static_cast<Eigen::Index>(epoch.columns.size()));
    for (std::size_t i = 0; i < epoch.columns.size(); ++i) {
      common[static_cast<Eigen::Index>(i)] = step.common[epoch.columns[i]];
    }
    Eigen::VectorXd poses = epoch.start;
    if (!epoch.bodies.empty()) poses.noalias() -= epoch.by_common * common;
    step.predicted_decrease += epoch.decrease;
    for (const StationElimination& station : epoch.stations) {
      Vector6d& moved = step.station[static_cast<std::size_t>(station.photo)];
      moved = station.start - station.by_common * common;
      if (!epoch.bodies.empty()) moved.noalias() -= station.by_poses * poses;
      step.predicted_decrease += station.decrease;
    }
    for (std::size_t b = 0; b < epoch.bodies.size(); ++b) {
      step.pose[static_cast<std::size_t>(epoch.bodies[b])][e] =
          poses.segment<6>(6 * static_cast<Eigen::Index>(b));
    }
  }
  return step;
}

NetworkGeometry stepped(const Network& network, const NetworkGeometry& geometry, const BundleLayout& layout,
                        const BundleStep& step) {
  NetworkGeometry next = geometry;
  for (std::size_t c = 0; c < layout.interior.size(); ++c) {
    const auto rank = layout.interior_basis[c].cols();
    if (rank > 0) {
      next.cameras[c].parameters += layout.interior_basis[c] * step.common.segment(layout.interior[c], rank);
    }
  }
  if (layout.print_scale >= 0) next.print_scale += step.common[layout.print_scale];
  for (std::size_t f = 0; f < layout.feature_pose.size(); ++f) {
    const int first = layout.feature_pose[f];
    if (first < 0) continue;
    if (pose_columns(network.features[f]) == 3) {
      next.body_from_feature[f].translation += step.common.segment<3>(first);
    } else {
      next.body_from_feature[f] = perturbed(next.body_from_feature[f], step.common.segment<6>(first));
    }
  }
  for (std::size_t k = 0; k < layout.shape.size(); ++k) {
    if (layout.shape[k] >= 0) next.shape[static_cast<Eigen::Index>(k)] += step.common[layout.shape[k]];
  }
  for (std::size_t p = 0; p < network.photos.size(); ++p) {
    if (!next.has_photo[p]) continue;
    const int station = network.photos[p].station;
    if (station < 0) {
      next.camera_from_reference[p] = perturbed(next.camera_from_reference[p], step.station[p]);
    } else if (const int first = layout.station[static_cast<std::size_t>(station)]; first >= 0) {
      next.camera_from_reference[p] = perturbed(next.camera_from_reference[p], step.common.segment<6>(first));
    }
  }
  for (std::size_t b = kReferenceBody + 1; b < step.pose.size(); ++b) {
    for (std::size_t e = 0; e < step.pose[b].size(); ++e) {
      if (!next.has_pose[b][e]) continue;
      next.reference_from_body[b][e] = perturbed(next.reference_from_body[b][e], step.pose[b][e]);
    }
  }
  return next;
}

}  // namespace hexcal
