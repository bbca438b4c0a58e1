#pragma once

#include <Eigen/Core>
#include <vector>

#include "photogrammetry/camera/camera_model.h"

namespace hexcal {

/// A ray (x, y, 1) and the pixel that it falls on.
struct RayPixel {
  Eigen::Vector2d normalised;
  Eigen::Vector2d px;
};

/// Rays of a camera over a grid of its frame; pixels without a ray are left out.
[[nodiscard]] std::vector<RayPixel> frame_rays(const CameraModel& camera, int columns = 40, int rows = 30);

/// A camera in another model, and how far it is from the one that it stands for. No rotation is fitted: poses
/// stay.
struct LensModelFit {
  bool converged = false;
  CameraModel camera;
  double rms_px = 0;
  double max_px = 0;
};

/// Least-squares fit of a lens model to rays (Gauss-Newton); `held` parameters by name stay zero.
[[nodiscard]] LensModelFit fit_lens_model(const std::vector<RayPixel>& rays, int width_px, int height_px,
                                          LensModel lens, const std::vector<std::string>& held = {});

}  // namespace hexcal
