#pragma once

#include <Eigen/Core>

#include "photogrammetry/camera/camera_model.h"

namespace hexcal {

struct ParameterPrior {
  Eigen::VectorXd mean;
  Eigen::VectorXd sigma;
};

/// Prior of CameraModel::parameters so weak that data always win: every lens term may move the frame's corner
/// by half its radius (decentring and thin prism by a twentieth). It keeps terms finite that the data do not
/// see.
[[nodiscard]] ParameterPrior weak_camera_prior(const CameraModel& camera);

}  // namespace hexcal
