#include "photogrammetry/adjustment/bundle_system.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>

#include "kinematics/geometry/covariance.h"

namespace hexcal {
namespace {

constexpr std::size_t kSums = 16;  // partial sums, whatever the threads: fixes their order

// Contribution of an epoch to the reduced normal equations, in its own columns; lower triangle.
struct ReducedEpoch {
  Eigen::MatrixXd normal;
  Eigen::VectorXd right;
};

// Inverse of a damped 6x6 block; a block without information becomes zero and its unknown stays.
Matrix6d invert_block(Matrix6d block, double damping) {
  block.diagonal() *= 1 + damping;
  const Eigen::LDLT<Matrix6d> ldlt(block);
  if (ldlt.info() != Eigen::Success || !ldlt.isPositive()) return Matrix6d::Zero();
  const Matrix6d inverse = ldlt.solve(Matrix6d::Identity());
  return inverse.allFinite() ? Matrix6d(0.5 * (inverse + inverse.transpose())) : Matrix6d(Matrix6d::Zero());
}

std::vector<int> touched_columns(const Network& network, const std::vector<Sighting>& sightings,
                                 const std::vector<std::size_t>& members, const std::vector<double>& weights,
                                 const BundleLayout& layout) {
  std::vector<char> cameras(network.cameras.size(), 0);
  std::vector<char> markers(network.markers.size(), 0);
  for (const std::size_t s : members) {
    if (weights[s] == 0) continue;
    cameras[static_cast<std::size_t>(network.photos[static_cast<std::size_t>(sightings[s].photo)].camera)] =
        1;
    markers[static_cast<std::size_t>(sightings[s].marker)] = 1;
  }
  std::vector<int> columns;
  const auto add = [&](int first, int count) {
    for (int i = 0; first >= 0 && i < count; ++i) columns.push_back(first + i);
  };
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (cameras[c]) add(layout.interior[c], static_cast<int>(layout.interior_basis[c].cols()));
  }
  add(layout.print_scale, 1);
  for (std::size_t m = 0; m < markers.size(); ++m) {
    if (!markers[m]) continue;
    add(layout.marker_pose[m], 6);
    add(layout.marker_shape[m], 6);
  }
  std::sort(columns.begin(), columns.end());
  return columns;
}

struct EpochBlocks {
  std::vector<Matrix6d> photo;
  std::vector<Matrix6d> photo_epoch;
  std::vector<Matrix6Xd> photo_common;
  std::vector<Vector6d> photo_right;
  Matrix6d epoch = Matrix6d::Zero();
  Matrix6Xd epoch_common;
  Vector6d epoch_right = Vector6d::Zero();
};

// Eliminates the photographs, then the pose of the moving body, leaving the common parameters in `reduced`.
void eliminate(EpochBlocks& blocks, double damping, EpochElimination& epoch, ReducedEpoch& reduced) {
  const auto width = static_cast<Eigen::Index>(epoch.columns.size());
  const auto count = static_cast<Eigen::Index>(epoch.photos.size()) + (epoch.has_pose ? 1 : 0);
  // The eliminated blocks one below the other: one product takes them all from the normal equations.
  Eigen::MatrixXd blocks_by_common(6 * count, width);
  Eigen::MatrixXd eliminated_by_common(6 * count, width);
  for (std::size_t i = 0; i < epoch.photos.size(); ++i) {
    PhotoElimination& photo = epoch.photos[i];
    photo.inverse = invert_block(blocks.photo[i], damping);
    photo.start = photo.inverse * blocks.photo_right[i];
    photo.decrease = photo.start.dot(blocks.photo_right[i]);
    photo.by_epoch = photo.inverse * blocks.photo_epoch[i];
    photo.by_common.noalias() = photo.inverse * blocks.photo_common[i];
    blocks.epoch -= blocks.photo_epoch[i].transpose() * photo.by_epoch;
    blocks.epoch_right -= blocks.photo_epoch[i].transpose() * photo.start;
    blocks.epoch_common.noalias() -= blocks.photo_epoch[i].transpose() * photo.by_common;
    reduced.right.noalias() -= blocks.photo_common[i].transpose() * photo.start;
    if (width == 0) continue;  // all common parameters are held, as on a map of the markers
    const auto row = 6 * static_cast<Eigen::Index>(i);
    blocks_by_common.middleRows<6>(row) = blocks.photo_common[i];
    eliminated_by_common.middleRows<6>(row) = photo.by_common;
  }
  epoch.by_common = Matrix6Xd::Zero(6, width);
  if (epoch.has_pose) {
    epoch.inverse = invert_block(blocks.epoch, damping);
    epoch.start = epoch.inverse * blocks.epoch_right;
    epoch.decrease = epoch.start.dot(blocks.epoch_right);
    epoch.by_common.noalias() = epoch.inverse * blocks.epoch_common;
    reduced.right.noalias() -= blocks.epoch_common.transpose() * epoch.start;
    if (width > 0) {
      blocks_by_common.bottomRows<6>() = blocks.epoch_common;
      eliminated_by_common.bottomRows<6>() = epoch.by_common;
    }
  }
  if (count > 0 && reduced.normal.size() > 0) {
    reduced.normal.triangularView<Eigen::Lower>() -= blocks_by_common.transpose() * eliminated_by_common;
  }
}

void reduce_epoch(const Network& network, const NetworkGeometry& geometry,
                  const std::vector<Sighting>& sightings, const std::vector<std::size_t>& members,
                  const std::vector<double>& weights, const BundleLayout& layout,
                  const BundleSettings& settings, double damping, EpochElimination& epoch,
                  ReducedEpoch& reduced) {
  epoch.columns = touched_columns(network, sightings, members, weights, layout);
  const auto width = static_cast<Eigen::Index>(epoch.columns.size());
  std::vector<int> compact(static_cast<std::size_t>(layout.size), -1);
  for (std::size_t i = 0; i < epoch.columns.size(); ++i) {
    compact[static_cast<std::size_t>(epoch.columns[i])] = static_cast<int>(i);
  }
  const Eigen::Index summed = settings.common_moves ? width : 0;
  reduced.normal.setZero(summed, summed);
  reduced.right.setZero(width);
  EpochBlocks blocks;
  blocks.epoch_common = Matrix6Xd::Zero(6, width);

  SightingJacobian jacobian;
  CommonJacobian common;
  Vector8d r;
  for (const std::size_t s : members) {
    if (weights[s] == 0) continue;
    const Sighting& sighting = sightings[s];
    if (!sighting_residual(network, geometry, sighting, r, &jacobian)) continue;
    if (epoch.photos.empty() || epoch.photos.back().photo != sighting.photo) {
      epoch.photos.emplace_back();
      epoch.photos.back().photo = sighting.photo;
      blocks.photo.push_back(Matrix6d::Zero());
      blocks.photo_epoch.push_back(Matrix6d::Zero());
      blocks.photo_common.push_back(Matrix6Xd::Zero(6, width));
      blocks.photo_right.push_back(Vector6d::Zero());
    }
    const int camera = network.photos[static_cast<std::size_t>(sighting.photo)].camera;
    common_jacobian(layout, camera, sighting, jacobian, common);
    const double weight = weights[s] / settings.data_variance;
    const bool moving = network.markers[static_cast<std::size_t>(sighting.marker)].body == Body::moving;
    const Matrix86d jp = weight * jacobian.photo;
    blocks.photo.back().noalias() += jp.transpose() * jacobian.photo;
    blocks.photo_right.back().noalias() += jp.transpose() * r;
    const Matrix86d je = weight * jacobian.epoch;
    if (moving) {
      epoch.has_pose = true;
      blocks.epoch.noalias() += je.transpose() * jacobian.epoch;
      blocks.epoch_right.noalias() += je.transpose() * r;
      blocks.photo_epoch.back().noalias() += jp.transpose() * jacobian.epoch;
    }
    const Eigen::Index n = common.values.cols();
    const Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, CommonJacobian::kMax> pc =
        jp.transpose() * common.values;
    const Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, CommonJacobian::kMax> ec =
        je.transpose() * common.values;
    const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, CommonJacobian::kMax, CommonJacobian::kMax>
        cc = weight * (common.values.transpose() * common.values);
    const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, CommonJacobian::kMax, 1> cr =
        weight * (common.values.transpose() * r);
    for (Eigen::Index a = 0; a < n; ++a) {
      const int i = compact[static_cast<std::size_t>(common.column[static_cast<std::size_t>(a)])];
      blocks.photo_common.back().col(i) += pc.col(a);
      if (moving) blocks.epoch_common.col(i) += ec.col(a);
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

void add_row(const Eigen::RowVectorXd& row, double residual, BundleSystem& system) {
  system.normal.noalias() += row.transpose() * row;
  system.right += row.transpose() * residual;
}

double shape_sigma(const BundleSettings& settings, int mode) {
  return mode == 5 ? settings.flatness_sigma_mm : settings.squareness_sigma_mm;
}

// Distance between two marker points and its derivatives.
double length_between(const Network& network, const NetworkGeometry& geometry, const BundleLayout& layout,
                      const NetworkLength& length, Eigen::RowVectorXd* by_common) {
  Eigen::Matrix3Xd ja;
  Eigen::Matrix3Xd jb;
  const bool derive = by_common != nullptr;
  const Eigen::Vector3d d =
      marker_point(network, geometry, layout, length.marker_b, length.corner_b, derive ? &jb : nullptr) -
      marker_point(network, geometry, layout, length.marker_a, length.corner_a, derive ? &ja : nullptr);
  const double distance = d.norm();
  if (derive) *by_common = (d / distance).transpose() * (jb - ja);
  return distance;
}

bool length_is_used(const NetworkGeometry& geometry, const NetworkLength& length) {
  return geometry.has_marker[static_cast<std::size_t>(length.marker_a)] &&
         geometry.has_marker[static_cast<std::size_t>(length.marker_b)];
}

void add_priors(const Network& network, const NetworkGeometry& geometry, const BundleLayout& layout,
                const BundleSettings& settings, BundleSystem& system) {
  const Eigen::VectorXd z = interior_coordinates(geometry, layout);
  for (std::size_t c = 0; c < layout.interior.size(); ++c) {
    const double weight = 1 / (settings.interior_inflation[c] * settings.interior_inflation[c]);
    for (int i = layout.interior[c]; i < layout.interior[c] + layout.interior_basis[c].cols(); ++i) {
      system.normal(i, i) += weight;
      system.right[i] -= weight * z[i];
    }
  }
  if (layout.print_scale >= 0 && settings.print_scale_sigma > 0) {
    const double weight = 1 / (settings.print_scale_sigma * settings.print_scale_sigma);
    system.normal(layout.print_scale, layout.print_scale) += weight;
    system.right[layout.print_scale] -= weight * geometry.print_scale;
  }
  for (std::size_t m = 0; m < layout.marker_shape.size(); ++m) {
    for (int i = 0; layout.marker_shape[m] >= 0 && i < 6; ++i) {
      const double weight = 1 / (shape_sigma(settings, i) * shape_sigma(settings, i));
      system.normal(layout.marker_shape[m] + i, layout.marker_shape[m] + i) += weight;
      system.right[layout.marker_shape[m] + i] -= weight * geometry.shape_mm[m][i];
    }
  }
  if (layout.print_scale < 0) return;
  for (const NetworkLength& length : network.lengths) {
    if (!length_is_used(geometry, length)) continue;
    Eigen::RowVectorXd row;
    const double distance = length_between(network, geometry, layout, length, &row);
    add_row(row / length.sigma_mm, (length.length_mm - distance) / length.sigma_mm, system);
  }
}

}  // namespace

bool sighting_residual(const Network& network, const NetworkGeometry& geometry, const Sighting& sighting,
                       Vector8d& residual, SightingJacobian* jacobian) {
  const auto m = static_cast<std::size_t>(sighting.marker);
  Vector8d px;
  if (!project_marker(view_of(network, geometry, sighting), network.markers[m].size_mm, geometry.print_scale,
                      geometry.shape_mm[m], px, jacobian)) {
    return false;
  }
  const Matrix8d& w = sighting.whitener;  // lower triangular when all corners are used; unused rows are zero
  residual = w * (sighting.px - px);
  if (jacobian == nullptr) return true;
  jacobian->photo = (w * jacobian->photo).eval();
  jacobian->epoch = (w * jacobian->epoch).eval();
  jacobian->marker = (w * jacobian->marker).eval();
  jacobian->shape = (w * jacobian->shape).eval();
  jacobian->print_scale = (w * jacobian->print_scale).eval();
  jacobian->interior = (w * jacobian->interior).eval();
  return true;
}

void common_jacobian(const BundleLayout& layout, int camera, const Sighting& sighting,
                     const SightingJacobian& jacobian, CommonJacobian& out) {
  const auto c = static_cast<std::size_t>(camera);
  const auto m = static_cast<std::size_t>(sighting.marker);
  const auto interior = layout.interior_basis[c].cols();
  Eigen::Index n = interior + (layout.print_scale >= 0 ? 1 : 0) + (layout.marker_pose[m] >= 0 ? 6 : 0) +
                   (layout.marker_shape[m] >= 0 ? 6 : 0);
  out.values.resize(8, n);
  n = 0;
  const auto add = [&](int first, const auto& columns) {
    out.values.middleCols(n, columns.cols()) = columns;
    for (int i = 0; i < columns.cols(); ++i) out.column[static_cast<std::size_t>(n++)] = first + i;
  };
  if (interior > 0) add(layout.interior[c], (jacobian.interior * layout.interior_basis[c]).eval());
  if (layout.print_scale >= 0) add(layout.print_scale, jacobian.print_scale);
  if (layout.marker_pose[m] >= 0) add(layout.marker_pose[m], jacobian.marker);
  if (layout.marker_shape[m] >= 0) add(layout.marker_shape[m], jacobian.shape);
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
  add_priors(network, geometry, layout, settings, system);
  system.normal.diagonal() *= 1 + damping;
  return system;
}

BundleStep solve_bundle(const BundleSystem& system, const BundleLayout& layout,
                        const BundleSettings& settings, std::size_t num_photos) {
  BundleStep step;
  step.common = Eigen::VectorXd::Zero(layout.size);
  const Eigen::Index kept = settings.interior_moves ? 0 : layout.num_interior;
  const Eigen::Index n = settings.common_moves ? layout.size - kept : 0;
  if (n > 0) {
    step.common.tail(n) = system.normal.bottomRightCorner(n, n).selfadjointView<Eigen::Lower>().ldlt().solve(
        system.right.tail(n));
  }
  if (n > 0) step.predicted_decrease = step.common.dot(system.right);
  step.photo.assign(num_photos, Vector6d::Zero());
  for (const EpochElimination& epoch : system.epochs) {
    Eigen::VectorXd common(static_cast<Eigen::Index>(epoch.columns.size()));
    for (std::size_t i = 0; i < epoch.columns.size(); ++i) {
      common[static_cast<Eigen::Index>(i)] = step.common[epoch.columns[i]];
    }
    const Vector6d pose = epoch.start - epoch.by_common * common;
    step.predicted_decrease += epoch.decrease;
    for (const PhotoElimination& photo : epoch.photos) {
      step.photo[static_cast<std::size_t>(photo.photo)] =
          photo.start - photo.by_epoch * pose - photo.by_common * common;
      step.predicted_decrease += photo.decrease;
    }
    step.epoch.push_back(pose);
  }
  return step;
}

NetworkGeometry stepped(const NetworkGeometry& geometry, const BundleLayout& layout, const BundleStep& step) {
  NetworkGeometry next = geometry;
  for (std::size_t c = 0; c < layout.interior.size(); ++c) {
    const auto rank = layout.interior_basis[c].cols();
    if (rank > 0) {
      next.cameras[c].parameters += layout.interior_basis[c] * step.common.segment(layout.interior[c], rank);
    }
  }
  if (layout.print_scale >= 0) next.print_scale += step.common[layout.print_scale];
  for (std::size_t m = 0; m < layout.marker_pose.size(); ++m) {
    if (layout.marker_pose[m] >= 0) {
      next.body_from_marker[m] =
          perturbed(next.body_from_marker[m], step.common.segment<6>(layout.marker_pose[m]));
    }
    if (layout.marker_shape[m] >= 0) next.shape_mm[m] += step.common.segment<6>(layout.marker_shape[m]);
  }
  for (std::size_t p = 0; p < step.photo.size(); ++p) {
    if (next.has_photo[p]) next.camera_from_fixed[p] = perturbed(next.camera_from_fixed[p], step.photo[p]);
  }
  for (std::size_t e = 0; e < step.epoch.size(); ++e) {
    if (next.has_epoch[e]) next.fixed_from_moving[e] = perturbed(next.fixed_from_moving[e], step.epoch[e]);
  }
  return next;
}

Eigen::VectorXd interior_coordinates(const NetworkGeometry& geometry, const BundleLayout& layout) {
  Eigen::VectorXd z(layout.num_interior);
  for (std::size_t c = 0; c < layout.interior.size(); ++c) {
    const Eigen::MatrixXd& basis = layout.interior_basis[c];
    if (basis.cols() == 0) continue;
    const Eigen::VectorXd moved = Eigen::VectorXd(geometry.cameras[c].parameters) - layout.interior_start[c];
    z.segment(layout.interior[c], basis.cols()) = layout.interior_inverse[c] * moved;
  }
  return z;
}

double prior_cost(const Network& network, const NetworkGeometry& geometry, const BundleLayout& layout,
                  const BundleSettings& settings, int* rows) {
  double cost = 0;
  int count = 0;
  const Eigen::VectorXd z = interior_coordinates(geometry, layout);
  for (std::size_t c = 0; c < layout.interior.size() && settings.interior_moves; ++c) {
    const auto rank = layout.interior_basis[c].cols();
    if (rank > 0)
      cost += (z.segment(layout.interior[c], rank) / settings.interior_inflation[c]).squaredNorm();
    count += static_cast<int>(rank);
  }
  if (layout.print_scale >= 0 && settings.print_scale_sigma > 0) {
    cost += std::pow(geometry.print_scale / settings.print_scale_sigma, 2);
    ++count;
  }
  for (std::size_t m = 0; m < layout.marker_shape.size(); ++m) {
    if (layout.marker_shape[m] < 0) continue;
    for (int i = 0; i < 6; ++i) cost += std::pow(geometry.shape_mm[m][i] / shape_sigma(settings, i), 2);
    count += 6;
  }
  for (const NetworkLength& length : network.lengths) {
    if (layout.print_scale < 0 || !length_is_used(geometry, length)) continue;
    const double distance = length_between(network, geometry, layout, length, nullptr);
    cost += std::pow((length.length_mm - distance) / length.sigma_mm, 2);
    ++count;
  }
  if (rows != nullptr) *rows = count;
  return cost;
}

Eigen::Vector3d marker_point(const Network& network, const NetworkGeometry& geometry,
                             const BundleLayout& layout, int marker, int corner,
                             Eigen::Matrix3Xd* by_common) {
  const auto m = static_cast<std::size_t>(marker);
  const double size_mm = network.markers[m].size_mm;
  if (by_common != nullptr) *by_common = Eigen::Matrix3Xd::Zero(3, layout.size);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  const Eigen::Matrix3d rotation = geometry.body_from_marker[m].rotation_matrix();
  const int first = corner < 0 ? 0 : corner;
  const int last = corner < 0 ? 3 : corner;
  const double share = 1.0 / (last - first + 1);
  for (int c = first; c <= last; ++c) {
    const Eigen::Vector3d turned =
        rotation * corner_in_marker(c, size_mm * (1 + geometry.print_scale), geometry.shape_mm[m]);
    mean += share * (turned + geometry.body_from_marker[m].translation);
    if (by_common == nullptr) continue;
    if (layout.marker_pose[m] >= 0) {
      by_common->middleCols<3>(layout.marker_pose[m]) += share * Eigen::Matrix3d::Identity();
      by_common->middleCols<3>(layout.marker_pose[m] + 3) -= share * skew(turned);
    }
    if (layout.marker_shape[m] >= 0) {
      for (int i = 0; i < 6; ++i) {
        by_common->col(layout.marker_shape[m] + i) +=
            share * rotation * corner_in_marker(c, 0, SquareShape::Unit(i));
      }
    }
    if (layout.print_scale >= 0) {
      by_common->col(layout.print_scale) +=
          share * rotation * corner_in_marker(c, size_mm, SquareShape::Zero());
    }
  }
  return mean;
}

}  // namespace hexcal
