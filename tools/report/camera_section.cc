#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/report/markup.h"
#include "tools/report/report_sections.h"

namespace hexcal {
namespace {

using Facts = std::vector<std::pair<std::string, std::string>>;

template <typename Value>
void add_fact(Facts& facts, const char* term, const std::optional<Value>& value, const char* unit = "") {
  if (value) facts.emplace_back(term, fmt::format("{}{}", *value, unit));
}

Facts camera_facts(const CameraPart& part) {
  const CalibratedCamera& camera = part.camera;
  const LensSetting& setting = camera.setting;
  Facts facts{{"file", part.file},
              {"verdict of its calibration", camera_verdict_name(camera.quality.verdict)}};
  add_fact(facts, "make", setting.make);
  add_fact(facts, "model", setting.model);
  add_fact(facts, "serial number", setting.serial);
  add_fact(facts, "lens", setting.lens);
  add_fact(facts, "focal length", setting.focal_length_mm, " mm");
  add_fact(facts, "aperture f/", setting.f_number);
  facts.emplace_back("image size", fmt::format("{} x {} px", camera.model.width_px, camera.model.height_px));
  facts.emplace_back("lens model", std::string(lens_model_name(camera.model.lens)));
  const CameraQuality& quality = camera.quality;
  if (quality.photographs > 0) {
    facts.emplace_back("calibrated from",
                       fmt::format("{} photographs, {} points", quality.photographs, quality.points));
    facts.emplace_back("residuals", significant_text(quality.rms_px, 3) + " px rms, sigma0 " +
                                        significant_text(quality.sigma0, 3));
    facts.emplace_back("projection uncertainty",
                       significant_text(quality.uncertainty_centre_px, 2) + " px at the centre, " +
                           significant_text(quality.uncertainty_corner_px, 2) + " px in the corners");
    facts.emplace_back("coverage", significant_text(quality.coverage_percent, 3) + " % of the frame");
  }
  return facts;
}

HtmlTable parameter_table(const CalibratedCamera& camera) {
  HtmlTable table;
  table.caption = "Interior orientation";
  table.columns = {{"parameter", "", false, ""},
                   {"value", "", true, ""},
                   {"sigma", "", true, "one standard deviation; empty: held fixed or unknown"}};
  const std::vector<std::string>& names = camera_parameter_names(camera.model.lens);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const bool known = camera.covariance.rows() > k && camera.covariance(k, k) > 0;
    const double sigma = known ? std::sqrt(camera.covariance(k, k)) : 0;
    HtmlCell name;
    name.text = names[i];
    HtmlCell value;
    value.text = significant_text(camera.model.parameters[k], 8);
    value.sort_key = camera.model.parameters[k];
    HtmlCell sigma_cell;
    if (known) {
      sigma_cell.text = significant_text(sigma, 2);
      sigma_cell.sort_key = sigma;
    }
    table.rows.push_back({name, value, sigma_cell});
  }
  return table;
}

}  // namespace

Chart distortion_chart(const CalibratedCamera& camera) {
  const CameraModel& model = camera.model;
  const Eigen::Vector2d centre(model.cx_px(), model.cy_px());
  const Eigen::Vector2d corner(centre.x() > 0.5 * model.width_px ? 0 : model.width_px,
                               centre.y() > 0.5 * model.height_px ? 0 : model.height_px);
  Series series;
  series.kind = Series::Kind::line;
  constexpr int kSteps = 60;
  for (int i = 0; i <= kSteps; ++i) {
    const Eigen::Vector2d px = centre + (corner - centre) * (static_cast<double>(i) / kSteps);
    const auto normalised = model.normalised_from_image(px);
    if (!normalised) break;  // beyond the lens model's range
    const Eigen::Vector2d straight(model.fx_px() * normalised->x(), model.fy_px() * normalised->y());
    series.x.push_back(straight.norm());
    series.y.push_back((px - centre).norm() - straight.norm());
  }
  Panel panel;
  panel.x.title = "distance from the principal point without distortion (px)";
  panel.y.title = "distortion (px)";
  panel.series = {series};
  Chart chart;
  chart.id = "camera_distortion";
  chart.title = "Distortion from the centre to the far corner";
  chart.panels = {panel};
  chart.panel_size = {640, 240};
  return chart;
}

Html camera_section(const CameraPart& part) {
  Html out = html_facts(camera_facts(part));
  out += html_table(parameter_table(part.camera));
  out += html_figure(distortion_chart(part.camera));
  return out;
}

}  // namespace hexcal
