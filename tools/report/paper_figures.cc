#include "tools/report/paper_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace hexcal {
namespace {

// The paper names the parameters x-tran .. z-rot; roll, pitch and yaw are its x-, y- and z-rot.
constexpr std::array kParameters{"x-tran", "y-tran", "z-tran", "x-rot", "y-rot", "z-rot"};

// Errors that fall by more than this factor vanish on a linear axis.
constexpr double kLogarithmicFrom = 20;

double unit(Eigen::Index i) { return i < 3 ? 1 : kDegPerRad; }

Series series_of(const std::string& name, Series::Kind kind, int colour) {
  Series series;
  series.name = name;
  series.kind = kind;
  series.ink = series_ink(colour);
  return series;
}

std::vector<PosePair> kept(const MethodPoses& poses, const std::vector<bool>& wanted) {
  std::vector<PosePair> out;
  for (std::size_t i = 0; i < poses.pairs.size(); ++i) {
    if (poses.pairs[i] && wanted[i]) out.push_back(*poses.pairs[i]);
  }
  return out;
}

// Poses that all of `methods` keep.
std::vector<bool> shared_poses(const std::vector<const MethodPoses*>& methods) {
  std::vector<bool> shared(methods.at(0)->pairs.size(), true);
  for (const MethodPoses* method : methods) {
    for (std::size_t i = 0; i < shared.size(); ++i) shared[i] = shared[i] && method->pairs[i].has_value();
  }
  return shared;
}

struct BeforeAfter {
  ErrorStatistics before, after;
};

BeforeAfter statistics_of(const PaperData& data, const MethodPoses& method) {
  const std::vector<bool> shared = shared_poses({&data.before, &method});
  return {error_statistics(kept(data.before, shared)), error_statistics(kept(method, shared))};
}

std::vector<const MethodPoses*> before_and_all(const PaperData& data) {
  std::vector<const MethodPoses*> all{&data.before};
  for (const MethodPoses& method : data.methods) all.push_back(&method);
  return all;
}

// Absolute error of one parameter per pose, in mm or deg.
std::vector<double> absolute_errors(const MethodPoses& poses, Eigen::Index parameter) {
  std::vector<double> out;
  for (const auto& pair : poses.pairs) {
    out.push_back(pair ? std::abs(pose_error(pair->actual, pair->target)[parameter]) * unit(parameter)
                       : kNoNumber);
  }
  return out;
}

std::vector<Panel> position_and_orientation(const std::string& quantity) {
  std::vector<Panel> panels(2);
  panels[0].title = "Position";
  panels[0].y.title = quantity + " (mm)";
  panels[1].title = "Orientation";
  panels[1].y.title = quantity + " (deg)";
  return panels;
}

// Error ranges as bars: one series per entry, three parameters in each panel.
Chart range_chart(const std::vector<std::pair<std::string, ErrorStatistics>>& entries) {
  Chart chart;
  chart.panels = position_and_orientation("error range");
  for (std::size_t p = 0; p < 2; ++p) {
    Panel& panel = chart.panels[p];
    for (std::size_t i = 0; i < 3; ++i) panel.x.categories.emplace_back(kParameters[3 * p + i]);
    panel.value_labels = true;
    for (std::size_t e = 0; e < entries.size(); ++e) {
      Series series = series_of(entries[e].first, Series::Kind::bars, static_cast<int>(e));
      for (Eigen::Index i = 0; i < 3; ++i) {
        const Eigen::Index parameter = 3 * static_cast<Eigen::Index>(p) + i;
        series.y.push_back(entries[e].second.range[parameter] * unit(parameter));
      }
      panel.series.push_back(std::move(series));
    }
  }
  return chart;
}

// " (figure 12)": the number that the paper's figure of an option has, counted from that of option 1.
std::string paper_number(const std::string& method, const char* what, int first, int step) {
  for (int option = 1; option <= 3; ++option) {
    if (method == fmt::format("option{}", option))
      return fmt::format(" ({} {})", what, first + step * (option - 1));
  }
  return "";
}

// A method's name as part of a file name and an anchor: "kinematic + sag" is "kinematic_sag".
std::string identifier(const std::string& name) {
  std::string out;
  for (const char c : name) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-';
    if (plain) {
      out += c;
    } else if (!out.empty() && out.back() != '_') {
      out += '_';
    }
  }
  return out;
}

std::string kept_words(const PaperData& data, const MethodPoses& method) {
  const std::vector<bool> shared = shared_poses({&data.before, &method});
  const auto measured = std::count_if(data.before.pairs.begin(), data.before.pairs.end(),
                                      [](const auto& pair) { return pair.has_value(); });
  std::string words =
      fmt::format("Over {} of {} measured poses", std::count(shared.begin(), shared.end(), true), measured);
  if (!method.note.empty()) words += "; after: " + method.note;
  return words + ".";
}

HtmlCell label_cell(const std::string& text, const std::string& hint = "") {
  HtmlCell cell;
  cell.text = text;
  cell.hint = hint;
  return cell;
}

}  // namespace

Chart absolute_error_chart(const PaperData& data) {
  Chart chart;
  chart.id = "figure_09_absolute_errors";
  chart.title = "Absolute errors of the measured poses (figure 9)";
  chart.caption =
      "Target against measured pose before compensation. Bars are one standard deviation of the measurement; "
      "where "
      "they do not show they are smaller than the mark.";
  chart.columns = 1;
  chart.panel_size = {880, 270};
  chart.panels = position_and_orientation("absolute error");
  for (std::size_t p = 0; p < 2; ++p) {
    Panel& panel = chart.panels[p];
    panel.x.title = "pose";
    panel.x.categories = data.pose_ids;
    panel.y.low = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto parameter = static_cast<Eigen::Index>(3 * p + k);
      Series series = series_of(kParameters[3 * p + k], Series::Kind::points, static_cast<int>(k));
      series.y = absolute_errors(data.before, parameter);
      for (const auto& sigma : data.sigma)
        series.sigma.push_back(sigma ? (*sigma)[parameter] * unit(parameter) : 0);
      panel.series.push_back(std::move(series));
    }
  }
  return chart;
}

Chart uncalibrated_range_chart(const PaperData& data) {
  Chart chart = range_chart({{"before", error_statistics(kept(data.before, shared_poses({&data.before})))}});
  chart.id = "figure_10_ranges_before";
  chart.title = "Error ranges before compensation (figure 10)";
  chart.caption =
      "Largest minus smallest error of each parameter over all measured poses. A range is blind to an error "
      "that all "
      "poses share; the rms in the tables is not.";
  return chart;
}

Chart method_range_chart(const PaperData& data, std::size_t index) {
  const MethodPoses& method = data.methods.at(index);
  const BeforeAfter statistics = statistics_of(data, method);
  Chart chart = range_chart({{"before", statistics.before}, {method.name, statistics.after}});
  chart.id = "ranges_" + identifier(method.name);
  chart.title = fmt::format("Error ranges before and after {}{}", method.name,
                            paper_number(method.name, "figure", 11, 2));
  chart.caption = kept_words(data, method);
  return chart;
}

Chart method_deviation_chart(const PaperData& data, std::size_t index) {
  const MethodPoses& method = data.methods.at(index);
  Chart chart;
  chart.id = "deviations_" + identifier(method.name);
  chart.title = fmt::format("Absolute deviations per pose before and after {}{}", method.name,
                            paper_number(method.name, "figure", 12, 2));
  chart.caption = kept_words(data, method);
  chart.panel_size = {440, 210};
  const BeforeAfter statistics = statistics_of(data, method);
  bool logarithmic = false;
  // Position down the left column, orientation down the right.
  for (const std::size_t k : {0U, 3U, 1U, 4U, 2U, 5U}) {
    Panel panel;
    panel.title = kParameters[k];
    panel.x.categories = data.pose_ids;
    panel.y.title = k < 3 ? "deviation (mm)" : "deviation (deg)";

    panel.series = {series_of(data.before.name, Series::Kind::points, 0),
                    series_of(method.name, Series::Kind::points, 1)};
    panel.series[0].y = absolute_errors(data.before, static_cast<Eigen::Index>(k));
    panel.series[1].y = absolute_errors(method, static_cast<Eigen::Index>(k));
    const Eigen::Index parameter = static_cast<Eigen::Index>(k);
    panel.y.logarithmic =
        statistics.before.rms[parameter] > kLogarithmicFrom * statistics.after.rms[parameter];
    if (panel.y.logarithmic) {
      // A pose without an error, such as the home that defines LG, has no place on such an axis.
      for (Series& series : panel.series) std::ranges::replace(series.y, 0.0, kNoNumber);
    } else {
      panel.y.low = 0;
    }
    logarithmic = logarithmic || panel.y.logarithmic;
    chart.panels.push_back(std::move(panel));
  }
  if (logarithmic)
    chart.caption +=
        " Deviations that fell to less than a twentieth are on a logarithmic axis, to be seen at all.";
  return chart;
}

Chart improvement_chart(const PaperData& data) {
  Panel panel;
  panel.y.title = "improvement (%)";
  panel.value_labels = true;
  panel.series = {series_of("position", Series::Kind::bars, 0),
                  series_of("orientation", Series::Kind::bars, 1)};
  for (const MethodPoses& method : data.methods) {
    const BeforeAfter s = statistics_of(data, method);
    panel.x.categories.push_back(method.name);
    panel.series[0].y.push_back(
        improvement_percent(s.before.position_magnitude_mm, s.after.position_magnitude_mm));
    panel.series[1].y.push_back(
        improvement_percent(s.before.orientation_magnitude_rad, s.after.orientation_magnitude_rad));
  }
  Chart chart;
  chart.id = "figure_17_improvement";
  chart.title = "Magnitude of improvement of every method (figure 17)";
  chart.caption =
      "Of the paper's magnitude of error (eq. 7), each method over the poses that it keeps. A bar below zero "
      "is a "
      "method that made the machine worse.";
  chart.panels = {panel};
  chart.panel_size = {880, 280};
  return chart;
}

Chart all_ranges_chart(const PaperData& data) {
  const std::vector<const MethodPoses*> all = before_and_all(data);
  const std::vector<bool> shared = shared_poses(all);
  std::vector<std::pair<std::string, ErrorStatistics>> entries;
  for (const MethodPoses* method : all)
    entries.emplace_back(method->name, error_statistics(kept(*method, shared)));
  Chart chart = range_chart(entries);
  chart.id = "figure_18_all_ranges";
  chart.title = "Error ranges of all methods (figure 18)";
  chart.caption = fmt::format("Over the {} poses that all methods keep.", entries[0].second.poses);
  chart.columns = 1;
  chart.panel_size = {880, 260};
  return chart;
}

std::vector<Chart> paper_charts(const PaperData& data) {
  std::vector<Chart> charts{absolute_error_chart(data), uncalibrated_range_chart(data)};
  for (std::size_t i = 0; i < data.methods.size(); ++i) {
    if (!data.methods[i].has_figures) continue;
    charts.push_back(method_range_chart(data, i));
    charts.push_back(method_deviation_chart(data, i));
  }
  if (!data.methods.empty()) {
    charts.push_back(improvement_chart(data));
    charts.push_back(all_ranges_chart(data));
  }
  return charts;
}

HtmlTable magnitude_table(const PaperData& data) {
  HtmlTable table;
  table.caption =
      "Magnitude of error (eq. 7: root mean square of the three error ranges), each method over the poses it "
      "keeps";
  table.columns = {{"method", "", false, ""},           {"poses", "", true, ""},
                   {"position before", "mm", true, ""}, {"after", "mm", true, ""},
                   {"less by", "%", true, ""},          {"orientation before", "deg", true, ""},
                   {"after", "deg", true, ""},          {"less by", "%", true, ""}};
  for (const MethodPoses& method : data.methods) {
    const BeforeAfter s = statistics_of(data, method);
    table.rows.push_back(
        {label_cell(method.name + paper_number(method.name, "table", 2, 1), method.note),
         number_cell(s.after.poses, 0), significant_cell(s.before.position_magnitude_mm, 4),
         significant_cell(s.after.position_magnitude_mm, 4),
         less_by_cell(s.before.position_magnitude_mm, s.after.position_magnitude_mm),
         significant_cell(s.before.orientation_magnitude_rad * kDegPerRad, 4),
         significant_cell(s.after.orientation_magnitude_rad * kDegPerRad, 4),
         less_by_cell(s.before.orientation_magnitude_rad, s.after.orientation_magnitude_rad)});
  }
  return table;
}

HtmlTable fair_table(const PaperData& data) {
  const std::vector<const MethodPoses*> all = before_and_all(data);
  const std::vector<bool> shared = shared_poses(all);
  const ErrorStatistics before = error_statistics(kept(data.before, shared));
  HtmlTable table;
  table.caption = fmt::format("True errors of all methods over the same {} poses", before.poses);
  table.columns = {{"method", "", false, ""},
                   {"position rms", "mm", true, "of the distance between target and actual origin"},
                   {"position max", "mm", true, ""},
                   {"orientation rms", "deg", true, "of the angle of the rotation from target to actual"},
                   {"orientation max", "deg", true, ""},
                   {"less by", "%", true, ""},
                   {"less by", "%", true, ""},
                   {"dropped", "poses", true, "measured, but not kept by this method"}};
  for (const MethodPoses* poses : all) {
    const ErrorStatistics s = error_statistics(kept(*poses, shared));
    const bool first = poses == all[0];
    int dropped = 0;
    for (std::size_t i = 0; i < data.before.pairs.size(); ++i) {
      dropped += data.before.pairs[i].has_value() && !poses->pairs[i].has_value() ? 1 : 0;
    }
    table.rows.push_back({label_cell(poses->name, poses->note), significant_cell(s.position_rms_mm, 4),
                          significant_cell(s.position_max_mm, 4),
                          significant_cell(s.orientation_rms_rad * kDegPerRad, 4),
                          significant_cell(s.orientation_max_rad * kDegPerRad, 4),
                          less_by_cell(first ? 0 : before.position_rms_mm, s.position_rms_mm),
                          less_by_cell(first ? 0 : before.orientation_rms_rad, s.orientation_rms_rad),
                          number_cell(dropped, 0)});
  }
  return table;
}

}  // namespace hexcal
