#include "photogrammetry/adjustment/adjustment_errors.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace hexcal {
namespace {

// Root of a covariance that may be singular, over its correlations because its units differ by many orders.
Eigen::MatrixXd covariance_root(const Eigen::MatrixXd& covariance) {
  if (covariance.rows() == 0) return covariance;
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::VectorXd per_sigma = sigma.unaryExpr([](double s) { return s > 0 ? 1 / s : 0.0; });
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(per_sigma.asDiagonal() * covariance * per_sigma.asDiagonal());
  Eigen::MatrixXd root = ldlt.matrixL();
  root *= ldlt.vectorD().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  root = ldlt.transpositionsP().transpose() * root;
  return sigma.asDiagonal() * root;
}

}  // namespace

ResultErrors make_result_errors(const Network& network, const BundleLayout& layout,
                                const Eigen::MatrixXd& common_covariance) {
  ResultErrors errors;
  errors.features.features = network.features;
  errors.features.shapes = network.shapes;
  errors.layout = layout;
  errors.root = covariance_root(common_covariance);
  errors.epochs.resize(static_cast<std::size_t>(network.num_epochs));
  errors.photos.resize(network.photos.size());
  for (std::size_t p = 0; p < errors.photos.size(); ++p) {
    const int station = network.photos[p].station;
    ResultErrors::Photo& photo = errors.photos[p];
    photo.epoch = network.photos[p].epoch;
    photo.by_poses = Matrix6Xd::Zero(6, 0);
    photo.by_error = Matrix6Xd::Zero(6, errors.root.cols());
    const int first = station < 0 ? -1 : layout.station[static_cast<std::size_t>(station)];
    if (first >= 0) photo.by_error = errors.root.middleRows<6>(first);
  }
  return errors;
}

void add_epoch_errors(const EpochElimination& elimination, std::size_t epoch, ResultErrors& errors) {
  const Eigen::MatrixXd rows = errors.root(elimination.columns, Eigen::all);
  ResultErrors::Epoch& of_epoch = errors.epochs[epoch];
  of_epoch.bodies = elimination.bodies;
  of_epoch.own = elimination.inverse;
  of_epoch.by_error = Eigen::MatrixXd::Zero(elimination.by_common.rows(), errors.root.cols());
  if (!elimination.bodies.empty()) of_epoch.by_error.noalias() -= elimination.by_common * rows;
  for (const StationElimination& station : elimination.stations) {
    ResultErrors::Photo& of_photo = errors.photos[static_cast<std::size_t>(station.photo)];
    of_photo.own = station.inverse;
    of_photo.by_poses = station.by_poses;
    of_photo.by_error.noalias() = -station.by_common * rows;
    if (!elimination.bodies.empty()) of_photo.by_error.noalias() -= station.by_poses * of_epoch.by_error;
  }
}

int AdjustmentResult::num_errors() const { return errors ? static_cast<int>(errors->root.cols()) : 0; }

EstimatedPoint AdjustmentResult::point(int feature, int point) const {
  Eigen::Matrix3Xd by_columns;
  EstimatedPoint estimate;
  estimate.in_body = feature_point(errors->features, geometry, errors->layout, feature, point, &by_columns);
  const std::vector<int> columns = feature_columns(errors->features, errors->layout, feature);
  estimate.by_error = by_columns * errors->root(columns, Eigen::all);
  return estimate;
}

EstimatedMotion AdjustmentResult::body_from_feature(int feature) const {
  const auto f = static_cast<std::size_t>(feature);
  EstimatedMotion estimate;
  estimate.motion = geometry.body_from_feature[f];
  estimate.by_error = Matrix6Xd::Zero(6, errors->root.cols());
  const int first = errors->layout.feature_pose[f];
  if (first < 0) return estimate;
  const int count = pose_columns(errors->features.features[f]);
  estimate.by_error.topRows(count) = errors->root.middleRows(first, count);
  return estimate;
}

EstimatedMotion AdjustmentResult::reference_from_body(PoseIndex pose) const {
  const ResultErrors::Epoch& epoch = errors->epochs[static_cast<std::size_t>(pose.epoch)];
  EstimatedMotion estimate;
  estimate.motion =
      geometry.reference_from_body[static_cast<std::size_t>(pose.body)][static_cast<std::size_t>(pose.epoch)];
  estimate.by_error = Matrix6Xd::Zero(6, errors->root.cols());
  const auto found = std::find(epoch.bodies.begin(), epoch.bodies.end(), pose.body);
  if (found == epoch.bodies.end()) return estimate;
  const Eigen::Index row = 6 * (found - epoch.bodies.begin());
  estimate.by_error = epoch.by_error.middleRows<6>(row);
  estimate.own = epoch.own.block<6, 6>(row, row);
  return estimate;
}

EstimatedMotion AdjustmentResult::camera_from_reference(int photo) const {
  const auto p = static_cast<std::size_t>(photo);
  const ResultErrors::Photo& of_photo = errors->photos[p];
  EstimatedMotion estimate{geometry.camera_from_reference[p], of_photo.by_error, of_photo.own};
  if (of_photo.by_poses.cols() > 0) {
    const ResultErrors::Epoch& epoch = errors->epochs[static_cast<std::size_t>(of_photo.epoch)];
    estimate.own += of_photo.by_poses * epoch.own * of_photo.by_poses.transpose();
  }
  return estimate;
}

std::optional<EstimatedNumber> AdjustmentResult::print_scale() const {
  if (!errors || errors->layout.print_scale < 0) return std::nullopt;
  return EstimatedNumber{geometry.print_scale, errors->root.row(errors->layout.print_scale)};
}

Matrix6d AdjustmentResult::pose_covariance(PoseIndex a, PoseIndex b) const {
  const ResultErrors::Epoch& of_a = errors->epochs[static_cast<std::size_t>(a.epoch)];
  const ResultErrors::Epoch& of_b = errors->epochs[static_cast<std::size_t>(b.epoch)];
  const auto at_a = std::find(of_a.bodies.begin(), of_a.bodies.end(), a.body);
  const auto at_b = std::find(of_b.bodies.begin(), of_b.bodies.end(), b.body);
  if (at_a == of_a.bodies.end() || at_b == of_b.bodies.end()) return Matrix6d::Zero();
  const Eigen::Index i = 6 * (at_a - of_a.bodies.begin());
  const Eigen::Index j = 6 * (at_b - of_b.bodies.begin());
  Matrix6d covariance = of_a.by_error.middleRows<6>(i) * of_b.by_error.middleRows<6>(j).transpose();
  if (a.epoch == b.epoch) covariance += of_a.own.block<6, 6>(i, j);
  return covariance;
}

}  // namespace hexcal
