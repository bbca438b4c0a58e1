#include "camera_calib/fit_lens_model.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "camera_calib/parameter_prior.h"

namespace hexcal {
namespace {

// Similar triangles over the whole frame.
double rough_focal_length(const std::vector<RayPixel>& rays, const Eigen::Vector2d& centre) {
  double xx = 0;
  double xp = 0;
  for (const RayPixel& ray : rays) {
    xx += ray.normalised.squaredNorm();
    xp += ray.normalised.dot(ray.px - centre);
  }
  return xp / std::max(xx, 1e-300);
}

double mean_square(const CameraModel& camera, const std::vector<RayPixel>& rays, double* largest) {
  double sum = 0;
  for (const RayPixel& ray : rays) {
    const double square = (camera.image_from_normalised(ray.normalised) - ray.px).squaredNorm();
    sum += square;
    if (largest != nullptr) *largest = std::max(*largest, std::sqrt(square));
  }
  return sum / static_cast<double>(rays.size());
}

}  // namespace

std::vector<RayPixel> frame_rays(const CameraModel& camera, int columns, int rows) {
  std::vector<RayPixel> rays;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const Eigen::Vector2d px(i * (camera.width_px - 1.0) / (columns - 1),
                               j * (camera.height_px - 1.0) / (rows - 1));
      if (const auto normalised = camera.normalised_from_image(px)) rays.push_back({*normalised, px});
    }
  }
  return rays;
}

LensModelFit fit_lens_model(const std::vector<RayPixel>& rays, int width_px, int height_px, LensModel lens,
                            const std::vector<std::string>& held) {
  LensModelFit out;
  out.camera = CameraModel(width_px, height_px, 1.0, lens);
  if (rays.size() < 20) return out;
  CameraModel& camera = out.camera;
  camera.parameters[0] = rough_focal_length(rays, {camera.cx_px(), camera.cy_px()});
  if (!(camera.parameters[0] > 0)) return out;
  const auto& names = camera_parameter_names(lens);
  std::vector<Eigen::Index> free;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (std::find(held.begin(), held.end(), names[i]) == held.end())
      free.push_back(static_cast<Eigen::Index>(i));
  }
  const auto n = static_cast<Eigen::Index>(free.size());
  const Eigen::VectorXd sigma = weak_camera_prior(camera).sigma;
  double damping = 1e-6;
  double cost = mean_square(camera, rays, nullptr);
  for (int iteration = 0; iteration < 200 && damping < 1e6; ++iteration) {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
    for (const RayPixel& ray : rays) {
      Eigen::Matrix2d by_point;
      CameraModel::ByParameters by_parameters;
      const Eigen::Vector2d px = camera.image_from_normalised(ray.normalised, &by_point, &by_parameters);
      Eigen::MatrixXd j(2, n);
      // Columns in units of each parameter's reach over the frame, for a well-scaled system.
      for (Eigen::Index k = 0; k < n; ++k) {
        const Eigen::Index at = free[static_cast<std::size_t>(k)];
        j.col(k) = by_parameters.col(at) * sigma[at];
      }
      normal += j.transpose() * j;
      right += j.transpose() * (ray.px - px);
    }
    const Eigen::VectorXd diagonal = normal.diagonal();
    normal.diagonal() += damping * diagonal;
    normal.diagonal().array() += 1e-14 * diagonal.maxCoeff();
    const Eigen::VectorXd step = normal.ldlt().solve(right);
    CameraModel trial = camera;
    for (Eigen::Index k = 0; k < n; ++k) {
      const Eigen::Index at = free[static_cast<std::size_t>(k)];
      trial.parameters[at] += step[k] * sigma[at];
    }
    const double trial_cost = mean_square(trial, rays, nullptr);
    if (!(trial_cost < cost)) {
      damping *= 10;
      continue;
    }
    const bool done = cost - trial_cost < 1e-14 + 1e-9 * cost;
    camera = trial;
    cost = trial_cost;
    damping = std::max(damping * 0.1, 1e-15);
    if (done) break;
  }
  out.converged = camera.parameters.allFinite();
  out.rms_px = std::sqrt(mean_square(camera, rays, &out.max_px));
  return out;
}

}  // namespace hexcal
