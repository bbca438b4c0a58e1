#include "camera_calib/parameter_prior.h"

#include <cmath>

namespace hexcal {
namespace {

// How a term's displacement grows with the radius r (as coefficient * r^(power + 1)), and its share of r.
struct Term {
  int power;
  double share;
};

Term term_of(const std::string& name) {
  const int number = name[1] - '0';
  switch (name[0]) {
    case 'k':
      return {2 * (number > 3 ? number - 3 : number), 0.5};
    case 'a':
      return {number, 0.5};
    case 's':
      return {number % 2 == 1 ? 1 : 3, 0.05};
    default:
      return {1, 0.05};
  }
}

}  // namespace

ParameterPrior weak_camera_prior(const CameraModel& camera) {
  const double diagonal = std::hypot(camera.width_px, camera.height_px);
  const double corner = 0.5 * diagonal / camera.fy_px();
  const auto& names = camera_parameter_names(camera.lens);
  ParameterPrior prior;
  prior.mean = Eigen::VectorXd::Zero(camera.parameters.size());
  prior.sigma.resize(camera.parameters.size());
  prior.mean.head<CameraModel::kNumPinhole>() << camera.parameters[0], 0, 0.5 * (camera.width_px - 1),
      0.5 * (camera.height_px - 1);
  prior.sigma.head<CameraModel::kNumPinhole>() << 100 * camera.parameters[0], 0.05, diagonal, diagonal;
  for (Eigen::Index i = CameraModel::kNumPinhole; i < prior.sigma.size(); ++i) {
    const Term term = term_of(names[static_cast<std::size_t>(i)]);
    prior.sigma[i] = term.share / std::pow(corner, term.power);
  }
  return prior;
}

}  // namespace hexcal
