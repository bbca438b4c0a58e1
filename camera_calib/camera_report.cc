#include "camera_calib/camera_report.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "camera_calib/camera_advice.h"
#include "camera_calib/choose_model.h"
#include "kinematics/geometry/median.h"
#include "kinematics/geometry/pose.h"

namespace hexcal {
namespace {

double blur_of(const SheetPhotograph& photograph) {
  std::vector<double> blurs;
  for (const FeatureObservation& feature : photograph.features) {
    if (feature.blur_px > 0) blurs.push_back(feature.blur_px);
  }
  return median(std::move(blurs));
}

std::string status_without_view(const SheetPhotograph& photograph) {
  if (photograph.status != PhotographStatus::ok) return photograph.reason;
  if (!photograph.reason.empty()) return photograph.reason;
  return "too few points of a sheet can be measured";
}

void add_view(const SheetAdjustmentResult& fit, std::size_t v, PhotographRow& row, double& sum) {
  const SheetView& view = fit.state.views[v];
  for (std::size_t f = 0; f < view.features.size(); ++f) {
    if (view.rejected[f] != 0) {
      row.rejected += view.features[f].points();
      continue;
    }
    row.points += view.features[f].points();
    sum += fit.residuals_px[v][f].squaredNorm();
  }
  const Eigen::Vector3d& t = view.camera_from_sheet.translation;
  const Eigen::Vector3d normal = view.camera_from_sheet.rotation * Eigen::Vector3d::UnitZ();
  row.tilt_deg = kDegPerRad * std::acos(std::clamp(-normal.z(), -1.0, 1.0));
  row.distance_mm = t.norm();
}

std::vector<PhotographRow> photograph_rows(const std::vector<SheetPhotograph>& photographs,
                                           const SheetAdjustmentResult& fit) {
  std::vector<PhotographRow> rows;
  for (std::size_t p = 0; p < photographs.size(); ++p) {
    PhotographRow row;
    row.name = photographs[p].name;
    row.blur_px = blur_of(photographs[p]);
    double sum = 0;
    for (std::size_t v = 0; v < fit.state.views.size(); ++v) {
      if (fit.state.views[v].photograph == static_cast<int>(p)) add_view(fit, v, row, sum);
    }
    row.used = row.points > 0;
    row.rms_px = row.used ? std::sqrt(sum / row.points) : 0;
    const bool seen = row.points + row.rejected > 0;
    if (!seen) {
      row.status = status_without_view(photographs[p]);
    } else if (row.rejected > row.points) {
      row.status =
          "does not fit the others: another zoom setting, a moved or another sheet, or blur by motion";
    } else {
      row.status = "ok";
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

Coverage coverage_of(const SheetAdjustmentResult& fit) {
  Coverage coverage;
  const CameraModel& camera = fit.state.camera;
  for (const SheetView& view : fit.state.views) {
    for (std::size_t f = 0; f < view.features.size(); ++f) {
      if (view.rejected[f] != 0) continue;
      for (Eigen::Index i = 0; i < view.features[f].points(); ++i) {
        const Eigen::Vector2d px = view.features[f].px.segment<2>(2 * i);
        const int column = std::clamp(static_cast<int>(px.x() * Coverage::kSide / camera.width_px), 0, 4);
        const int row = std::clamp(static_cast<int>(px.y() * Coverage::kSide / camera.height_px), 0, 4);
        ++coverage.points[static_cast<std::size_t>(row * Coverage::kSide + column)];
      }
    }
  }
  return coverage;
}

std::vector<CameraCorrelation> correlated_pairs(LensModel lens, const Eigen::MatrixXd& covariance) {
  std::vector<CameraCorrelation> out;
  const auto& names = camera_parameter_names(lens);
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    for (Eigen::Index j = i + 1; j < covariance.rows(); ++j) {
      const double scale = std::sqrt(covariance(i, i) * covariance(j, j));
      if (scale <= 0 || std::abs(covariance(i, j)) <= 0.95 * scale) continue;
      out.push_back(
          {names[static_cast<std::size_t>(i)], names[static_cast<std::size_t>(j)], covariance(i, j) / scale});
    }
  }
  return out;
}

// Two calibrations that share no photograph.
std::optional<ProjectionDifference> halves_difference(const std::vector<Sheet>& sheets,
                                                      const CameraCalibration& calibration) {
  const CalibrationState& state = calibration.fit.adjustment.state;
  std::set<int> photographs;
  for (const SheetView& view : state.views) photographs.insert(view.photograph);
  if (photographs.size() < 6) return std::nullopt;
  SheetAdjustmentOptions options;
  // The sheet's shape is common to both halves: held at what all photographs gave.
  options.board = BoardFreedom::ideal;
  options.free_parameters = calibration.variant.free_parameters;
  options.extra_sigma_px = calibration.fit.extra_sigma_px;
  options.with_covariance = false;
  std::vector<CameraModel> cameras;
  for (const std::size_t half : {0, 1}) {
    std::set<int> wanted;
    std::size_t i = 0;
    for (const int p : photographs) {
      if (i++ % 2 == half) wanted.insert(p);
    }
    const SheetAdjustmentResult fit =
        adjust_sheets(sheets, views_where(state, [&wanted](int p) { return wanted.count(p) != 0; }), options);
    if (!fit.converged) return std::nullopt;
    cameras.push_back(fit.state.camera);
  }
  return projection_difference(cameras[0], cameras[1]);
}

void add_quality(const CameraCalibration& calibration, CameraReport& report) {
  CameraQuality& quality = report.quality;
  double sum = 0;
  for (const PhotographRow& row : report.photographs) {
    if (!row.used) continue;
    ++quality.photographs;
    quality.points += row.points;
    sum += row.points * row.rms_px * row.rms_px;
  }
  quality.rms_px = quality.points > 0 ? std::sqrt(sum / quality.points) : 0;
  quality.sigma0 = calibration.fit.adjustment.sigma0();
  const ProjectionUncertainty& u = report.uncertainty;
  const auto at = [&u](int i, int j) { return u.sigma_px(static_cast<std::size_t>(j * u.columns + i)); };
  quality.uncertainty_centre_px = at(u.columns / 2, u.rows / 2);
  quality.uncertainty_corner_px =
      std::max({at(0, 0), at(u.columns - 1, 0), at(0, u.rows - 1), at(u.columns - 1, u.rows - 1)});
  quality.cross_validation_px = report.halves ? report.halves->rms_px : 0;
  const auto filled = std::count_if(report.coverage.points.begin(), report.coverage.points.end(),
                                    [](int n) { return n >= 4; });
  quality.coverage_percent =
      100.0 * static_cast<double>(filled) / static_cast<double>(report.coverage.points.size());
}

}  // namespace

CameraReport report_calibration(const std::vector<Sheet>& sheets,
                                const std::vector<SheetPhotograph>& photographs,
                                const CameraCalibration& calibration) {
  CameraReport report;
  const SheetAdjustmentResult& fit = calibration.fit.adjustment;
  report.photographs = photograph_rows(photographs, fit);
  if (calibration.status == CalibrationStatus::ok) {
    const double sigma0 = std::max(fit.sigma0(), 1e-12);
    const Eigen::Index n = fit.state.camera.parameters.size();
    report.covariance = fit.camera_covariance.size() > 0
                            ? Eigen::MatrixXd(sigma0 * sigma0 * fit.camera_covariance)
                            : Eigen::MatrixXd::Zero(n, n);
    report.coverage = coverage_of(fit);
    report.uncertainty = projection_uncertainty(fit.state.camera, report.covariance);
    report.correlations = correlated_pairs(fit.state.camera.lens, report.covariance);
    report.halves = halves_difference(sheets, calibration);
    add_quality(calibration, report);
  }
  report.advice = camera_advice(sheets, calibration, report);
  report.quality.verdict = CameraVerdict::good;
  for (const Advice& advice : report.advice) {
    if (advice.level == AdviceLevel::retake) report.quality.verdict = CameraVerdict::retake;
    if (advice.level == AdviceLevel::usable && report.quality.verdict == CameraVerdict::good) {
      report.quality.verdict = CameraVerdict::usable;
    }
  }
  return report;
}

}  // namespace hexcal
