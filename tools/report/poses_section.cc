#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "tools/report/markup.h"
#include "tools/report/report_sections.h"

namespace hexcal {
namespace {

constexpr std::array kNames{"x", "y", "z", "roll", "pitch", "yaw"};

// Decimals that show a value down to about a tenth of its standard deviation.
int decimals_for(double sigma, int otherwise) {
  if (!(sigma > 0)) return otherwise;
  return std::clamp(static_cast<int>(std::ceil(-std::log10(sigma))) + 1, 0, 6);
}

HtmlCell parameter_cell(const PoseRecord& record, Eigen::Index i) {
  if (!record.pose) return {};
  const double sigma = record.sigma ? mm_deg(*record.sigma)[i] : 0;
  const int decimals = decimals_for(sigma, 4);
  HtmlCell cell = number_cell(mm_deg(record.pose->vector())[i], decimals);
  if (sigma > 0) cell.second = "\xC2\xB1" + number_text(sigma, std::pow(10.0, -decimals));
  return cell;
}

}  // namespace

PoseLight pose_light(const PoseRecord& record) {
  if (!record.pose || is_suspect(record.status)) return {Light::bad, status_text(record.status)};
  if (record.status != "ok") return {Light::warning, status_text(record.status)};
  if (record.sigma && record.sigma->isZero(0)) return {Light::none, "defines the home"};
  return {record.remarks.empty() ? Light::good : Light::warning, record.remarks};
}

Html poses_section(const CampaignReport& report) {
  std::map<std::string, Pose> targets;
  for (const PoseRecord& target : report.targets) {
    if (target.pose) targets[target.id] = *target.pose;
  }
  HtmlTable table;
  table.caption = "Measured poses of the lower grip relative to its home; small: one standard deviation";
  table.columns.push_back({"pose", "", false, ""});
  table.columns.push_back({"verdict", "", false, ""});
  for (std::size_t i = 0; i < 6; ++i) table.columns.push_back({kNames[i], i < 3 ? "mm" : "deg", true, ""});
  if (!targets.empty()) {
    table.columns.push_back({"error", "mm", true, "distance between target and measured origin"});
    table.columns.push_back({"error", "deg", true, "angle of the rotation from target to measured pose"});
  }
  table.columns.push_back({"photos", "", true, "photographs used"});
  table.columns.push_back({"markers", "", true, ""});
  table.columns.push_back({"residual", "px rms", true, ""});
  for (const PoseRecord& record : report.poses) {
    std::vector<HtmlCell> cells(2);
    cells[0].text = record.id;
    const PoseLight verdict = pose_light(record);
    cells[1].text = verdict.words.empty() ? "good" : verdict.words;
    cells[1].light = verdict.light;
    cells[1].sort_key = static_cast<double>(verdict.light);
    for (Eigen::Index i = 0; i < 6; ++i) cells.push_back(parameter_cell(record, i));
    if (!targets.empty()) {
      const auto target = targets.find(record.id);
      const bool both = record.pose && target != targets.end();
      ErrorStatistics error;
      if (both) {
        const std::array pair{PosePair{target->second, *record.pose}};
        error = error_statistics(pair);
      }
      cells.push_back(number_cell(both ? error.position_rms_mm : kNoNumber, 3));
      cells.push_back(number_cell(both ? error.orientation_rms_rad * kDegPerRad : kNoNumber, 3));
    }
    cells.push_back(number_cell(record.images ? *record.images : kNoNumber, 0));
    cells.push_back(number_cell(record.markers ? *record.markers : kNoNumber, 0));
    cells.push_back(number_cell(record.rms_px.value_or(kNoNumber), 3));
    table.rows.push_back(std::move(cells));
  }
  return html_table(table);
}

Html methods_section(const CampaignReport& report) {
  const PaperData data = paper_data(report);
  Html out;
  if (report.compensation) {
    const CalibrationReport& calibration = report.compensation->calibration;
    out += html_paragraph(fmt::format("Chosen: {}. {}", calibration.chosen, calibration.why));
    HtmlTable table;
    table.caption =
        calibration.comparison.leave_one_out
            ? "Error that would remain after compensation; each pose predicted by a model that had not seen "
              "it"
            : fmt::format("Error that would remain after compensation; poses held out in {} parts",
                          calibration.comparison.folds);
    table.columns = {{"method", "", false, ""},
                     {"position rms", "mm", true, "with its standard error"},
                     {"orientation rms", "deg", true, "with its standard error"},
                     {"position max", "mm", true, ""},
                     {"orientation max", "deg", true, ""},
                     {"targets lost", "", true, "out of stroke after compensation"},
                     {"remark", "", false, ""}};
    for (std::size_t i = 0; i < calibration.comparison.methods.size(); ++i) {
      const CrossValidation& method = calibration.comparison.methods[i];
      const bool failed = !method.failure.empty();
      std::vector<HtmlCell> cells(7);
      cells[0].text = method.name;
      cells[6].text = method.failure;
      if (!failed) {
        const auto with_error = [](double value, double se) {
          HtmlCell cell = significant_cell(value, 3);
          if (se > 0) cell.text += " \xC2\xB1 " + significant_text(se, 2);
          return cell;
        };
        cells[1] = with_error(method.errors.position_rms_mm, method.position_rms_se_mm);
        cells[2] = with_error(method.errors.orientation_rms_rad * kDegPerRad,
                              method.orientation_rms_se_rad * kDegPerRad);
        cells[3] = significant_cell(method.errors.position_max_mm, 3);
        cells[4] = significant_cell(method.errors.orientation_max_rad * kDegPerRad, 3);
        cells[5] = number_cell(method.targets_lost, 0);
      }
      if (method.name == calibration.chosen) table.highlighted = i;
      table.rows.push_back(std::move(cells));
    }
    out += html_table(table);
  }
  if (!data.methods.empty()) {
    out += html_element("h3", html_text("The same poses for every method"));
    out += html_table(fair_table(data));
  }
  out += html_element("h3", html_text("The paper's figures and tables for this campaign"));
  if (!data.methods.empty()) out += html_table(magnitude_table(data));
  for (const Chart& chart : paper_charts(data)) out += html_figure(chart);
  return out;
}

}  // namespace hexcal
