#include "camera_calib/marker_size.h"

#include <cmath>

namespace hexcal {

std::optional<MarkerSizeError> marker_size_error(const Sheet& sheet, int index,
                                                 const SheetAdjustmentResult& fit) {
  const CameraModel& camera = fit.state.camera;
  const std::vector<Eigen::Vector3d> points =
      shaped_points(sheet, fit.state.shapes[static_cast<std::size_t>(index)]);
  const SheetGeometry geometry = sheet_geometry(sheet);
  // Regression of the residuals, and of the points' own freedom from the drawing, on the radial direction of
  // each marker's corners.
  double jj = 0;
  double jr = 0;
  double rr = 0;
  int count = 0;
  for (std::size_t v = 0; v < fit.state.views.size(); ++v) {
    const SheetView& view = fit.state.views[v];
    if (view.sheet != index) continue;
    for (std::size_t f = 0; f < view.features.size(); ++f) {
      const FeatureObservation& feature = view.features[f];
      if (feature.points() != 4) continue;
      const SheetMarker& marker = geometry.markers[static_cast<std::size_t>(feature.first_point / 4)];
      for (int corner = 0; corner < 4; ++corner) {
        const Eigen::Vector3d& point = points[static_cast<std::size_t>(feature.first_point + corner)];
        const Eigen::Vector2d outward = marker.corner_mm(corner) - marker.centre_mm;
        const auto a = camera.project(view.camera_from_sheet * point);
        const auto b = camera.project(view.camera_from_sheet *
                                      (point + 0.01 * Eigen::Vector3d(outward.x(), outward.y(), 0)));
        if (!a || !b) continue;
        const Eigen::Vector2d j = (*b - *a) / 0.01;
        Eigen::Vector2d r = fit.residuals_px[v][f].segment<2>(2 * corner);
        // Freed points have swallowed the difference: their part of it counts too.
        const Eigen::Vector2d moved = point.head<2>() - marker.corner_mm(corner);
        if (!fit.state.shapes[static_cast<std::size_t>(index)].shift_mm.empty()) {
          r += j * moved.dot(outward) / outward.squaredNorm();
        }
        jj += j.squaredNorm();
        jr += j.dot(r);
        rr += r.squaredNorm();
        count += 2;
      }
    }
  }
  if (count < 16 || !(jj > 0)) return std::nullopt;
  MarkerSizeError out;
  out.relative = jr / jj;
  out.sigma = std::sqrt(std::max(0.0, rr - jr * jr / jj) / (count - 1) / jj);
  return out;
}

}  // namespace hexcal
