#include "tools/io/calibration_tables.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "kinematics/geometry/pose.h"
#include "tools/io/csv_table.h"

namespace hexcal {

std::string format_sheet_poses(const std::string& head, const std::vector<SheetPhotograph>& photographs,
                               const CameraCalibration& calibration) {
  std::string out = head;
  out +=
      "photograph,sheet,x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg,sigma_x_mm,sigma_y_mm,sigma_z_mm,sigma_rx_deg,"
      "sigma_ry_deg,sigma_rz_deg\n";
  const SheetAdjustmentResult& fit = calibration.fit.adjustment;
  for (std::size_t v = 0; v < fit.state.views.size(); ++v) {
    const SheetView& view = fit.state.views[v];
    const Eigen::Vector3d& t = view.camera_from_sheet.translation;
    const Eigen::Vector3d w = kDegPerRad * rotation_vector_from_quaternion(view.camera_from_sheet.rotation);
    out += fmt::format("{},{},{:.6f},{:.6f},{:.6f},{:.8f},{:.8f},{:.8f}",
                       csv_field(photographs[static_cast<std::size_t>(view.photograph)].name), view.sheet + 1,
                       t.x(), t.y(), t.z(), w.x(), w.y(), w.z());
    for (Eigen::Index i = 0; i < 6; ++i) {
      if (v < fit.pose_covariance.size()) {
        const double sigma = fit.sigma0() * std::sqrt(fit.pose_covariance[v](i, i));
        out += fmt::format(",{:.4g}", i < 3 ? sigma : kDegPerRad * sigma);
      } else {
        out += ',';
      }
    }
    out += '\n';
  }
  return out;
}

std::string format_calibration_inputs(const std::string& head, const std::vector<Sheet>& sheets,
                                      const std::vector<SheetPhotograph>& photographs,
                                      const CameraCalibration& calibration) {
  std::string out = head + fmt::format("# extra_sigma_px {}\n", calibration.fit.extra_sigma_px);
  for (const Sheet& sheet : sheets) out += fmt::format("# sheet: {}\n", describe_sheet(sheet));
  out += "photograph,sha256,sheet,point,used,px,covariance_px2,residual_px\n";
  const SheetAdjustmentResult& fit = calibration.fit.adjustment;
  std::vector<std::vector<SheetPoint>> points;
  for (const Sheet& sheet : sheets) points.push_back(sheet_points(sheet_geometry(sheet)));
  for (std::size_t v = 0; v < fit.state.views.size(); ++v) {
    const SheetView& view = fit.state.views[v];
    const SheetPhotograph& photograph = photographs[static_cast<std::size_t>(view.photograph)];
    for (std::size_t f = 0; f < view.features.size(); ++f) {
      const FeatureObservation& feature = view.features[f];
      std::vector<double> triangle;
      for (Eigen::Index i = 0; i < feature.px.size(); ++i) {
        for (Eigen::Index j = 0; j <= i; ++j) triangle.push_back(feature.covariance_px2(i, j));
      }
      const auto& residual = fit.residuals_px[v][f];
      const auto& point =
          points[static_cast<std::size_t>(view.sheet)][static_cast<std::size_t>(feature.first_point)];
      out += fmt::format("{},{},{},{},{},{:.5f},{:.4g},{:.4f}\n", csv_field(photograph.name),
                         photograph.sha256, view.sheet + 1, point.name, view.rejected[f] == 0 ? 1 : 0,
                         fmt::join(feature.px.data(), feature.px.data() + feature.px.size(), " "),
                         fmt::join(triangle, " "),
                         fmt::join(residual.data(), residual.data() + residual.size(), " "));
    }
  }
  return out;
}

}  // namespace hexcal
