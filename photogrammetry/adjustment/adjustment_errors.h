#pragma once

#include <vector>

#include "photogrammetry/adjustment/adjustment_result.h"
#include "photogrammetry/adjustment/bundle_system.h"

namespace hexcal {

/// How the errors of a result come about; what AdjustmentResult answers from.
struct ResultErrors {
  /// Errors of the poses of an epoch's moving bodies, six rows each.
  struct Epoch {
    std::vector<int> bodies;
    Eigen::MatrixXd own;
    Eigen::MatrixXd by_error;
  };
  /// Error of a photograph's camera_from_reference: own noise, minus by_poses times that of its epoch's
  /// poses.
  struct Photo {
    int epoch = 0;
    Matrix6d own = Matrix6d::Zero();
    Matrix6Xd by_poses;
    Matrix6Xd by_error;
  };
  Network features;      ///< features and shapes alone
  BundleLayout layout;   ///< columns of the common parameters
  Eigen::MatrixXd root;  ///< root * root^T is the covariance of the common parameters
  std::vector<Epoch> epochs;
  std::vector<Photo> photos;
};

[[nodiscard]] ResultErrors make_result_errors(const Network& network, const BundleLayout& layout,
                                              const Eigen::MatrixXd& common_covariance);

/// Puts the errors of an epoch and its photographs into those of the result.
void add_epoch_errors(const EpochElimination& elimination, std::size_t epoch, ResultErrors& errors);

}  // namespace hexcal
