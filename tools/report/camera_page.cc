#include "tools/report/camera_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/report/html_page.h"
#include "tools/report/markup.h"
#include "tools/report/report_sections.h"

namespace hexcal {
namespace {

Verdict verdict_of(const CameraReport& report) {
  Verdict verdict;
  switch (report.quality.verdict) {
    case CameraVerdict::good:
      verdict.light = Light::good;
      verdict.headline = "The camera is good: use it.";
      break;
    case CameraVerdict::usable:
      verdict.light = Light::warning;
      verdict.headline = "The camera is usable; the points below would make it better.";
      break;
    default:
      verdict.light = Light::bad;
      verdict.headline = "Take the photographs again, as described below.";
  }
  for (const Advice& advice : report.advice) verdict.findings.push_back(advice.words);
  return verdict;
}

// A length of 1, 2 or 5 times a power of ten near `value`.
double round_length(double value) {
  const double unit = std::pow(10, std::floor(std::log10(std::max(value, 1e-12))));
  for (const double factor : {5.0, 2.0, 1.0}) {
    if (factor * unit <= value) return factor * unit;
  }
  return unit;
}

// Calls use(photograph, pixel, residual) for every point that was used.
template <typename Use>
void for_each_point(const SheetAdjustmentResult& fit, Use use) {
  for (std::size_t v = 0; v < fit.state.views.size(); ++v) {
    const SheetView& view = fit.state.views[v];
    for (std::size_t f = 0; f < view.features.size(); ++f) {
      if (view.rejected[f] != 0) continue;
      for (Eigen::Index i = 0; i < view.features[f].points(); ++i) {
        use(view.photograph, Eigen::Vector2d(view.features[f].px.segment<2>(2 * i)),
            Eigen::Vector2d(fit.residuals_px[v][f].segment<2>(2 * i)));
      }
    }
  }
}

Panel frame_panel(const CameraModel& camera) {
  Panel panel;
  panel.photograph_frame = true;
  panel.x = {"x (px)", {}, 0.0, camera.width_px - 1.0};
  panel.y = {"y (px)", {}, 0.0, camera.height_px - 1.0};
  return panel;
}

Chart residuals_chart(const SheetAdjustmentResult& fit, const Coverage& coverage, double rms_px) {
  const CameraModel& camera = fit.state.camera;
  Panel panel = frame_panel(camera);
  panel.arrow_scale = 0.02 * camera.width_px / std::max(rms_px, 1e-9);
  panel.arrow_key = round_length(2 * rms_px);
  panel.arrow_unit = "px";
  for_each_point(fit, [&panel](int, const Eigen::Vector2d& px, const Eigen::Vector2d& residual) {
    panel.arrows.push_back({px, residual, Ink::series0, ""});
  });
  Panel counts = frame_panel(camera);
  counts.cells_title = "points";
  for (int row = 0; row < Coverage::kSide; ++row) {
    for (int column = 0; column < Coverage::kSide; ++column) {
      const Eigen::Vector2d size(camera.width_px / 5.0, camera.height_px / 5.0);
      const Eigen::Vector2d low(column * size.x(), row * size.y());
      const int points = coverage.points[static_cast<std::size_t>(row * Coverage::kSide + column)];
      counts.cells.push_back(
          {low, low + size, static_cast<double>(points), fmt::format("{} points", points)});
    }
  }
  Chart chart;
  chart.id = "camera_residuals";
  chart.title = "Residuals and coverage over the frame";
  chart.caption =
      "Left: measured minus model at every point of all photographs; neighbouring arrows should point in "
      "unlike "
      "directions. Right: points in each of 25 parts of the frame; none should be empty, least of all a "
      "corner.";
  chart.panels = {panel, counts};
  chart.panel_size = {460, 330};
  return chart;
}

Chart uncertainty_chart(const CameraModel& camera, const ProjectionUncertainty& uncertainty) {
  Panel panel = frame_panel(camera);
  panel.cells_title = "sigma (px)";
  const Eigen::Vector2d half(0.5 * camera.width_px / (uncertainty.columns - 1),
                             0.5 * camera.height_px / (uncertainty.rows - 1));
  const Eigen::Vector2d last(camera.width_px - 1, camera.height_px - 1);
  for (std::size_t i = 0; i < uncertainty.px.size(); ++i) {
    const Eigen::Vector2d low = (uncertainty.px[i] - half).cwiseMax(0.0);
    const Eigen::Vector2d high = (uncertainty.px[i] + half).cwiseMin(last);
    const double sigma = uncertainty.sigma_px(i);
    panel.cells.push_back({low, high, sigma, fmt::format("{} px", significant_text(sigma, 2))});
  }
  Chart chart;
  chart.id = "camera_uncertainty";
  chart.title = "Uncertainty of projection";
  chart.caption =
      "One standard deviation of where the camera puts a ray, worst axis, best rotation taken out, at large "
      "distance. "
      "Corners without points are guesses of the lens model.";
  chart.panels = {panel};
  chart.panel_size = {620, 400};
  return chart;
}

// Mean radial residual in rings around the principal point: what the lens model leaves.
Chart radial_residual_chart(const SheetAdjustmentResult& fit) {
  constexpr std::size_t kRings = 16;
  const CameraModel& camera = fit.state.camera;
  const Eigen::Vector2d centre(camera.cx_px(), camera.cy_px());
  const double reach = std::hypot(std::max(centre.x(), camera.width_px - centre.x()),
                                  std::max(centre.y(), camera.height_px - centre.y()));
  struct Ring {
    double sum = 0, squares = 0, count = 0;
  };
  std::vector<Ring> rings(kRings);
  for_each_point(fit, [&](int, const Eigen::Vector2d& px, const Eigen::Vector2d& residual) {
    const Eigen::Vector2d from_centre = px - centre;
    const double radius = from_centre.norm();
    Ring& ring = rings[std::min(static_cast<std::size_t>(radius / reach * kRings), kRings - 1)];
    const double outward = residual.dot(from_centre) / std::max(radius, 1e-9);
    ring.sum += outward;
    ring.squares += outward * outward;
    ring.count += 1;
  });
  Series series;
  for (std::size_t i = 0; i < kRings; ++i) {
    if (rings[i].count < 4) continue;
    const double mean = rings[i].sum / rings[i].count;
    series.x.push_back((static_cast<double>(i) + 0.5) * reach / kRings);
    series.y.push_back(mean);
    series.sigma.push_back(
        std::sqrt(std::max(rings[i].squares / rings[i].count - mean * mean, 0.0) / rings[i].count));
    series.tips.push_back(fmt::format("{} px, {:.0f} points", significant_text(mean, 2), rings[i].count));
  }
  Panel panel;
  panel.x.title = "distance from the principal point (px)";
  panel.y.title = "mean outward residual (px)";
  panel.series = {series};
  Chart chart;
  chart.id = "camera_radial_residuals";
  chart.title = "What the lens model leaves along the radius";
  chart.caption =
      "Bars are one standard deviation of the mean. A curve instead of scatter about zero: the lens model "
      "does not follow this lens.";
  chart.panels = {panel};
  chart.panel_size = {640, 240};
  return chart;
}

Chart strip_chart(const std::vector<PhotographRow>& rows) {
  Series rms{"", Series::Kind::bars, Ink::series0, {}, {}, {}, {}, false};
  Panel panel;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    panel.x.categories.push_back(fmt::format("{}", i + 1));
    rms.y.push_back(rows[i].used ? rows[i].rms_px : std::nan(""));
    rms.tips.push_back(rows[i].used ? fmt::format("{}: {} px rms, {} points, {:.0f} degrees", rows[i].name,
                                                  significant_text(rows[i].rms_px, 3), rows[i].points,
                                                  rows[i].tilt_deg)
                                    : fmt::format("{}: {}", rows[i].name, rows[i].status));
  }
  panel.x.title = "photograph";
  panel.y.title = "residuals (px rms)";
  panel.series = {rms};
  Chart chart;
  chart.id = "camera_photographs";
  chart.title = "Photograph by photograph";
  chart.panels = {panel};
  chart.panel_size = {760, 220};
  return chart;
}

HtmlTable photograph_table(const std::vector<PhotographRow>& rows) {
  HtmlTable table;
  table.columns = {{"photograph", "", false, ""},
                   {"points", "", true, ""},
                   {"outliers", "", true, ""},
                   {"rms", "px", true, ""},
                   {"tilt", "deg", true, "between the sheet and the image plane"},
                   {"distance", "mm", true, ""},
                   {"blur", "px", true, "standard deviation of the point spread"},
                   {"remark", "", false, ""}};
  for (const PhotographRow& row : rows) {
    const double nan = std::nan("");
    table.rows.push_back(
        {text_cell(row.name, row.status == "ok" ? Light::good : Light::bad), number_cell(row.points, 0),
         number_cell(row.rejected, 0), number_cell(row.used ? row.rms_px : nan, 3),
         number_cell(row.used ? row.tilt_deg : nan, 1), number_cell(row.used ? row.distance_mm : nan, 0),
         number_cell(row.blur_px > 0 ? row.blur_px : nan, 2),
         text_cell(row.status == "ok" ? "" : row.status)});
  }
  return table;
}

HtmlTable model_table(const std::vector<ModelTrial>& trials) {
  HtmlTable table;
  table.caption =
      "Chosen is the poorest model whose photographs left out one by one fit no worse than with the best, as "
      "far as "
      "the spread between photographs can tell.";
  table.columns = {{"model", "", false, ""},
                   {"unknowns", "", true, ""},
                   {"AICc", "", true, "corrected Akaike criterion, relative to the best of its group"},
                   {"cross-validation", "px", true, "rms at photographs that the camera has not seen"}};
  for (std::size_t i = 0; i < trials.size(); ++i) {
    if (trials[i].chosen) table.highlighted = i;
    table.rows.push_back({text_cell(trials[i].name), number_cell(trials[i].unknowns, 0),
                          number_cell(trials[i].aicc, 1),
                          number_cell(trials[i].cross_validation_px.value_or(std::nan("")), 4)});
  }
  return table;
}

}  // namespace

std::string render_camera_page(const std::vector<Sheet>& sheets, const CameraCalibration& calibration,
                               const std::string& camera_file, const LensSetting& setting,
                               const CameraReport& report) {
  const SheetAdjustmentResult& fit = calibration.fit.adjustment;
  HtmlPage page;
  page.title = "Camera calibration";
  for (const Sheet& sheet : sheets) {
    page.subtitle += (page.subtitle.empty() ? "" : "; ") + describe_sheet(sheet);
  }
  page.verdict = html_verdict(verdict_of(report));
  Html photographs = html_figure(strip_chart(report.photographs));
  photographs += html_table(photograph_table(report.photographs));
  if (calibration.status == CalibrationStatus::ok) {
    const CalibratedCamera camera{fit.state.camera, report.covariance, setting, report.quality};
    CameraPart part;
    part.file = camera_file;
    part.camera = camera;
    page.sections.push_back({"camera", "Camera", camera_section(part)});
    Html frame = html_figure(residuals_chart(fit, report.coverage, report.quality.rms_px));
    frame += html_figure(uncertainty_chart(fit.state.camera, report.uncertainty));
    frame += html_figure(radial_residual_chart(fit));
    page.sections.push_back({"frame", "Over the frame", frame});
  }
  page.sections.push_back({"photographs", "Photographs", photographs});
  if (!calibration.trials.empty()) {
    page.sections.push_back({"models", "Models", html_table(model_table(calibration.trials))});
  }
  return render_page(page);
}

}  // namespace hexcal
