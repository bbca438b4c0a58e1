#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "tools/report/markup.h"
#include "tools/report/report_sections.h"

namespace hexcal {
namespace {

// "leg 3 base x" belongs to leg 3; 0: no leg's.
int leg_of(const std::string& name) {
  if (!name.starts_with("leg ") || name.size() < 5) return 0;
  const int leg = name[4] - '0';
  return leg >= 1 && leg <= 6 ? leg : 0;
}

std::string without_leg(const std::string& name) { return leg_of(name) == 0 ? name : name.substr(6); }

HtmlTable parameter_table(const Identifiability& identified, const std::string& caption, bool of_legs) {
  HtmlTable table;
  table.caption = caption;
  table.columns = {{"parameter", "", false, ""},
                   {"correction", "", true, "identified minus nominal"},
                   {"sigma", "", true, "one standard deviation after the measurement"},
                   {"correction / sigma", "", true, "beyond 3 the parameter differs from the drawing"},
                   {"tolerance", "", true, "what was expected before the measurement"},
                   {"unit", "", false, ""}};
  for (const ParameterReport& parameter : identified.parameters) {
    if ((leg_of(parameter.name) > 0) != of_legs) continue;
    const double ratio = parameter.sigma > 0 ? parameter.value / parameter.sigma : 0;
    HtmlCell significance = number_cell(ratio, 1);
    if (std::abs(ratio) > 3) significance.light = Light::warning;
    table.rows.push_back({text_cell(parameter.name), number_cell(parameter.value, 4),
                          number_cell(parameter.sigma, 4), significance, number_cell(parameter.tolerance, 3),
                          text_cell(parameter.unit)});
  }
  return table;
}

}  // namespace

Chart correction_chart(const Identifiability& identifiability) {
  Chart chart;
  chart.id = "machine_corrections";
  chart.title = "Identified machine against its drawing, leg by leg";
  chart.caption = "Corrections with one-sigma bars. Joint coordinates and offsets in mm; scales in per cent.";
  chart.columns = 3;
  chart.panel_size = {320, 230};
  for (int leg = 1; leg <= 6; ++leg) {
    Panel panel;
    panel.title = fmt::format("Leg {}", leg);
    panel.y.title = "correction (mm or %)";
    Series series;
    series.kind = Series::Kind::bars;
    series.ink = Ink::series0;
    for (const ParameterReport& parameter : identifiability.parameters) {
      if (leg_of(parameter.name) != leg) continue;
      panel.x.categories.push_back(without_leg(parameter.name));
      series.y.push_back(parameter.value);
      series.sigma.push_back(parameter.sigma);
      series.tips.push_back(fmt::format("{}: {} \xC2\xB1 {} {}", parameter.name,
                                        significant_text(parameter.value, 4),
                                        significant_text(parameter.sigma, 2), parameter.unit));
    }
    if (series.y.empty()) continue;
    panel.series = {series};
    chart.panels.push_back(std::move(panel));
  }
  return chart;
}

Html machine_section(const CompensationPart& part) {
  Html out;
  const CalibrationReport& calibration = part.calibration;
  if (!calibration.identifiability || !calibration.fitted.identified) {
    return html_paragraph(
        fmt::format("{} models the errors of poses, not the machine: there are no parameters to show.",
                    calibration.chosen));
  }
  const Identifiability& identifiability = *calibration.identifiability;
  const IdentifyResult& identified = *calibration.fitted.identified;
  out += html_facts({{"free parameters", std::to_string(identifiability.free_parameters)},
                     {"determined by the poses", std::to_string(identifiability.determined)},
                     {"condition", significant_text(identifiability.condition, 2)},
                     {"sigma0", significant_text(identified.sigma0_of_measurement, 3)},
                     {"leg noise", significant_text(identified.leg_sigma_mm, 2) + " mm"}});
  Html legs;
  for (const LegDiagnosis& leg : identifiability.legs) legs += html_element("li", html_text(leg.sentence));
  for (const std::string& words : identifiability.beyond_geometry)
    legs += html_element("li", html_text(words));
  out += html_element("ul", legs);
  const Chart corrections = correction_chart(identifiability);
  if (!corrections.panels.empty()) out += html_figure(corrections);
  out += html_table(parameter_table(identifiability, "Parameters of the legs", true));
  const HtmlTable others = parameter_table(identifiability, "Other parameters", false);
  if (!others.rows.empty()) out += html_table(others);
  if (!identifiability.weak.empty()) {
    HtmlTable table;
    table.caption = "Combinations about which the poses say little";
    table.columns = {{"parameters", "", false, ""},
                     {"gain", "", true, "tolerance over sigma of the data; below 1 the tolerance decides"}};
    for (const WeakDirection& weak : identifiability.weak) {
      table.rows.push_back(
          {text_cell(fmt::format("{}", fmt::join(weak.parameters, ", "))), number_cell(weak.gain, 2)});
    }
    out += html_table(table);
  }
  if (!identifiability.correlations.empty()) {
    HtmlTable table;
    table.caption = "Parameters that the poses can hardly tell apart";
    table.columns = {{"one", "", false, ""}, {"other", "", false, ""}, {"correlation", "", true, ""}};
    for (const CorrelatedPair& pair : identifiability.correlations) {
      table.rows.push_back({text_cell(pair.a), text_cell(pair.b), number_cell(pair.correlation, 3)});
    }
    out += html_table(table);
  }
  return out;
}

}  // namespace hexcal
