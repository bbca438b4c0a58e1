#include "tools/report/comparison_page.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "kinematics/geometry/median.h"
#include "tools/report/markup.h"
#include "tools/report/report_sections.h"

namespace hexcal {
namespace {

constexpr std::array kParameterNames{"x", "y", "z", "roll", "pitch", "yaw"};
// A pose counts as better or worse only beyond this many standard deviations of the difference.
constexpr double kClearly = 3;

// Poses with a value before and after, and what compensation promised for them where it did.
struct SharedErrors {
  std::vector<std::size_t> index;  ///< into PaperData::pose_ids
  std::vector<PosePair> before, promised, after;
  ErrorStatistics of_before, of_promised, of_after;
};

const MethodPoses* promise_of(const PaperData& data) {
  return data.methods.size() > 1 ? &data.methods.front() : nullptr;
}

SharedErrors shared_errors(const PaperData& data) {
  SharedErrors out;
  const MethodPoses* promise = promise_of(data);
  for (std::size_t i = 0; i < data.pose_ids.size(); ++i) {
    const auto& after = data.methods.back().pairs[i];
    // The home that defines a frame is zero by definition in both and says nothing.
    const bool defines = data.sigma[i] && !(data.sigma[i]->norm() > 0);
    if (!data.before.pairs[i] || !after || defines) continue;
    out.index.push_back(i);
    out.before.push_back(*data.before.pairs[i]);
    out.after.push_back(*after);
    if (promise != nullptr && promise->pairs[i]) out.promised.push_back(*promise->pairs[i]);
  }
  out.of_before = error_statistics(out.before);
  out.of_promised = error_statistics(out.promised);
  out.of_after = error_statistics(out.after);
  return out;
}

double typical_sigma(const CampaignReport& report, bool position) {
  std::vector<double> values;
  for (const PoseRecord& record : report.poses) {
    if (!record.sigma || !(record.sigma->norm() > 0)) continue;
    values.push_back(position ? record.sigma->head<3>().norm() : record.sigma->tail<3>().norm() * kDegPerRad);
  }
  return values.empty() ? kNoNumber : median(std::move(values));
}

struct PoseChange {
  ErrorStatistics before, after;
  double sigma_mm = 0, sigma_deg = 0;  ///< of the difference, from both rounds
  Light light = Light::none;
};

const char* change_words(Light light) {
  return light == Light::good ? "better" : light == Light::warning ? "worse" : "the same within noise";
}

std::optional<Vector6d> sigma_of(const CampaignReport& report, const std::string& id) {
  const auto found = std::ranges::find(report.poses, id, &PoseRecord::id);
  return found == report.poses.end() ? std::nullopt : found->sigma;
}

PoseChange pose_change(const ComparisonReport& report, const std::string& id, const PosePair& before,
                       const PosePair& after) {
  PoseChange change;
  change.before = error_statistics(std::array{before});
  change.after = error_statistics(std::array{after});
  for (const CampaignReport* round : {&report.before, &report.after}) {
    const std::optional<Vector6d> sigma = sigma_of(*round, id).value_or(Vector6d::Zero());
    change.sigma_mm = std::hypot(change.sigma_mm, sigma->head<3>().norm());
    change.sigma_deg = std::hypot(change.sigma_deg, sigma->tail<3>().norm() * kDegPerRad);
  }
  const double worse_mm = change.after.position_rms_mm - change.before.position_rms_mm;
  const double worse_deg =
      (change.after.orientation_rms_rad - change.before.orientation_rms_rad) * kDegPerRad;
  if (worse_mm > kClearly * change.sigma_mm || worse_deg > kClearly * change.sigma_deg) {
    change.light = Light::warning;
  } else if (worse_mm < -kClearly * change.sigma_mm || worse_deg < -kClearly * change.sigma_deg) {
    change.light = Light::good;
  }
  return change;
}

std::vector<std::string> worse_poses(const ComparisonReport& report, const PaperData& data,
                                     const SharedErrors& shared) {
  std::vector<std::string> worse;
  for (std::size_t k = 0; k < shared.index.size(); ++k) {
    const std::string& id = data.pose_ids[shared.index[k]];
    if (pose_change(report, id, shared.before[k], shared.after[k]).light == Light::warning)
      worse.push_back(id);
  }
  return worse;
}

// One quantity before, as promised and after.
struct ComparedRow {
  std::string name, unit;
  double before, promised, after;
  int decimals;
  bool less_is_better = true;
};

HtmlTable comparison_table(const std::string& caption, const std::vector<ComparedRow>& rows, bool promised,
                           const ComparisonReport& report) {
  HtmlTable table;
  table.caption = caption;
  table.sortable = false;
  table.columns = {
      {"quantity", "", false, ""}, {"unit", "", false, ""}, {"before", report.before.name, true, ""}};
  if (promised)
    table.columns.push_back({"promised", "cross-validated", true, "by the compensation of the first"});
  table.columns.push_back({"after", report.after.name, true, ""});
  table.columns.push_back({"less by", "%", true, ""});
  for (const ComparedRow& row : rows) {
    std::vector<HtmlCell> cells{text_cell(row.name), text_cell(row.unit),
                                number_cell(row.before, row.decimals)};
    if (promised) cells.push_back(number_cell(row.promised, row.decimals));
    cells.push_back(number_cell(row.after, row.decimals));
    const bool meaningful = row.less_is_better && row.before > 0;
    cells.push_back(less_by_cell(meaningful ? row.before : 0, row.after));
    table.rows.push_back(std::move(cells));
  }
  return table;
}

Html error_tables(const ComparisonReport& report, const PaperData& data, const SharedErrors& shared) {
  const ErrorStatistics& b = shared.of_before;
  const ErrorStatistics& p = shared.of_promised;
  const ErrorStatistics& a = shared.of_after;
  const bool promised = p.poses > 0;
  std::vector<ComparedRow> rows{
      {"position rms", "mm", b.position_rms_mm, p.position_rms_mm, a.position_rms_mm, 4},
      {"position max", "mm", b.position_max_mm, p.position_max_mm, a.position_max_mm, 4},
      {"position magnitude (eq. 7)", "mm", b.position_magnitude_mm, p.position_magnitude_mm,
       a.position_magnitude_mm, 4},
      {"orientation rms", "deg", b.orientation_rms_rad * kDegPerRad, p.orientation_rms_rad * kDegPerRad,
       a.orientation_rms_rad * kDegPerRad, 5},
      {"orientation max", "deg", b.orientation_max_rad * kDegPerRad, p.orientation_max_rad * kDegPerRad,
       a.orientation_max_rad * kDegPerRad, 5},
      {"orientation magnitude (eq. 7)", "deg", b.orientation_magnitude_rad * kDegPerRad,
       p.orientation_magnitude_rad * kDegPerRad, a.orientation_magnitude_rad * kDegPerRad, 5}};
  std::string caption = fmt::format("Errors over the {} poses that both rounds measured", b.poses);
  if (promised && p.poses < b.poses) caption += fmt::format("; promised: {} of them", p.poses);
  Html out = html_table(comparison_table(caption, rows, promised, report));
  rows.clear();
  for (std::size_t i = 0; i < 6; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const double unit = i < 3 ? 1 : kDegPerRad;
    const char* name = i < 3 ? "mm" : "deg";
    rows.push_back({fmt::format("{} mean", kParameterNames[i]), name, b.mean[k] * unit, p.mean[k] * unit,
                    a.mean[k] * unit, 4, false});
    rows.push_back({fmt::format("{} rms", kParameterNames[i]), name, b.rms[k] * unit, p.rms[k] * unit,
                    a.rms[k] * unit, 4});
  }
  out +=
      html_table(comparison_table("Each parameter: a mean is what all poses share", rows, promised, report));
  HtmlTable poses;
  poses.caption = "Error of each pose before and after";
  poses.columns = {{"pose", "", false, ""},
                   {"verdict", "", false, ""},
                   {"position before", "mm", true, ""},
                   {"after", "mm", true, ""},
                   {"sigma", "mm", true, "of the difference, one standard deviation"},
                   {"orientation before", "deg", true, ""},
                   {"after", "deg", true, ""},
                   {"sigma", "deg", true, "of the difference, one standard deviation"}};
  for (std::size_t k = 0; k < shared.index.size(); ++k) {
    const std::string& id = data.pose_ids[shared.index[k]];
    const PoseChange change = pose_change(report, id, shared.before[k], shared.after[k]);
    poses.rows.push_back(
        {text_cell(id), text_cell(change_words(change.light), change.light),
         number_cell(change.before.position_rms_mm, 4), number_cell(change.after.position_rms_mm, 4),
         number_cell(change.sigma_mm, 4), number_cell(change.before.orientation_rms_rad * kDegPerRad, 5),
         number_cell(change.after.orientation_rms_rad * kDegPerRad, 5), number_cell(change.sigma_deg, 5)});
  }
  return out += html_table(poses);
}

Html measurement_table(const ComparisonReport& report) {
  const auto measured = [](const CampaignReport& round) {
    return static_cast<double>(
        std::ranges::count_if(round.poses, [](const PoseRecord& record) { return record.pose.has_value(); }));
  };
  const CampaignReport& b = report.before;
  const CampaignReport& a = report.after;
  std::vector<ComparedRow> rows{
      {"poses measured", "", measured(b), 0, measured(a), 0, false},
      {"typical position sigma", "mm", typical_sigma(b, true), 0, typical_sigma(a, true), 5},
      {"typical orientation sigma", "deg", typical_sigma(b, false), 0, typical_sigma(a, false), 6}};
  if (b.network && a.network) {
    const auto photographs = [](const CampaignReport& round) {
      return static_cast<double>(round.network->photographs.size());
    };
    rows.push_back({"photographs", "", photographs(b), 0, photographs(a), 0, false});
    rows.push_back({"residuals rms", "px", b.network->rms_px, 0, a.network->rms_px, 4});
    rows.push_back({"sigma0", "", b.network->sigma0, 0, a.network->sigma0, 3, false});
  }
  return html_table(comparison_table("How well each round was measured", rows, false, report));
}

void judge_change(const ComparisonReport& report, const PaperData& data, const SharedErrors& shared,
                  Verdict& verdict) {
  const ErrorStatistics& b = shared.of_before;
  const ErrorStatistics& a = shared.of_after;
  const double before_deg = b.orientation_rms_rad * kDegPerRad;
  const double after_deg = a.orientation_rms_rad * kDegPerRad;
  verdict.headline = fmt::format(
      "Over {} poses measured in both rounds the position error went from {} to {} mm rms ({} % less) and "
      "the "
      "orientation error from {} to {} deg rms ({} % less).",
      b.poses, significant_text(b.position_rms_mm, 3), significant_text(a.position_rms_mm, 3),
      less_by_text(b.position_rms_mm, a.position_rms_mm), significant_text(before_deg, 3),
      significant_text(after_deg, 3), less_by_text(before_deg, after_deg));
  const bool position_worse = a.position_rms_mm > b.position_rms_mm;
  const bool orientation_worse = after_deg > before_deg;
  verdict.light = position_worse && orientation_worse   ? Light::bad
                  : position_worse || orientation_worse ? Light::warning
                                                        : Light::good;
  if (verdict.light != Light::good) {
    verdict.next_steps.emplace_back(
        "Check that the corrected `results/actuators.csv` of the first round is what the controller got, and "
        "that hexapod.yaml is the controller's own geometry.");
  }
  const std::vector<std::string> worse = worse_poses(report, data, shared);
  if (!worse.empty() && verdict.light == Light::good) {
    verdict.findings.push_back(fmt::format("{} of {} poses became worse, beyond the measurement's noise: {}.",
                                           worse.size(), b.poses, fmt::join(worse, ", ")));
    verdict.light = Light::warning;
  }
  const ErrorStatistics& p = shared.of_promised;
  if (p.poses > 0) {
    verdict.findings.push_back(fmt::format(
        "Cross-validation of the first round promised {} mm and {} deg rms; measured: {} mm and {} "
        "deg.",
        significant_text(p.position_rms_mm, 3), significant_text(p.orientation_rms_rad * kDegPerRad, 3),
        significant_text(a.position_rms_mm, 3), significant_text(after_deg, 3)));
    if (a.position_rms_mm > 2 * p.position_rms_mm) {
      verdict.findings.emplace_back(
          "That is more than twice the promise: the machine changed between the rounds, or repeats itself "
          "worse than one round can show.");
      verdict.light = std::max(verdict.light, Light::warning);
    }
  }
  const double noise_mm = typical_sigma(report.after, true);
  if (noise_mm > 0 && a.position_rms_mm < 2 * noise_mm) {
    verdict.findings.emplace_back(
        "What remains is about the noise of the measurement itself: there is nothing left to compensate.");
  } else if (verdict.light != Light::bad) {
    verdict.next_steps.push_back(
        fmt::format("What remains is {} times the noise of the measurement. To go on, run `hexcal "
                    "compensate` on the second "
                    "round and send its commands.",
                    significant_text(noise_mm > 0 ? a.position_rms_mm / noise_mm : 0, 2)));
  }
}

}  // namespace

PaperData comparison_data(const ComparisonReport& report) {
  PaperData data = paper_data(report.before);
  const std::string chosen =
      report.before.compensation ? report.before.compensation->calibration.chosen : std::string();
  std::erase_if(data.methods, [&](const MethodPoses& method) { return method.name != chosen; });
  for (MethodPoses& method : data.methods) {
    method.name = "promised";
    method.note = fmt::format("what {} promised, cross-validated", chosen);
  }
  const PaperData after = paper_data(report.after);
  MethodPoses measured{"after", "measured in " + report.after.name, {}};
  for (const std::string& id : data.pose_ids) {
    const auto place = std::ranges::find(after.pose_ids, id);
    measured.pairs.push_back(
        place == after.pose_ids.end()
            ? std::nullopt
            : after.before.pairs[static_cast<std::size_t>(place - after.pose_ids.begin())]);
  }
  data.methods.push_back(std::move(measured));
  return data;
}

Verdict comparison_verdict(const ComparisonReport& report) {
  const PaperData data = comparison_data(report);
  const SharedErrors shared = shared_errors(data);
  Verdict verdict;
  if (shared.index.empty()) {
    verdict.light = Light::bad;
    verdict.headline =
        fmt::format("{} and {} share no measured pose with a target.", report.before.name, report.after.name);
    for (const CampaignReport* round : {&report.before, &report.after}) {
      if (!round->poses.empty()) continue;
      verdict.headline = fmt::format("Nothing has been measured in {} yet.", round->name);
      verdict.next_steps = {fmt::format("Run `hexcal measure` on {}.", round->name)};
      return verdict;
    }
    verdict.next_steps = {
        "Give the same poses the same names in both targets.csv and measure both campaigns."};
    return verdict;
  }
  judge_change(report, data, shared, verdict);
  return verdict;
}

HtmlPage comparison_page(const ComparisonReport& report) {
  HtmlPage page;
  page.title = fmt::format("hexcal: {} against {}", report.after.name, report.before.name);
  const PaperData data = comparison_data(report);
  const SharedErrors shared = shared_errors(data);
  page.subtitle = fmt::format("before: {}; after: {}; {} poses in both", report.before.name,
                              report.after.name, shared.index.size());
  page.verdict = html_verdict(comparison_verdict(report));
  if (!shared.index.empty()) {
    page.sections.push_back({"errors", "Before and after", error_tables(report, data, shared)});
    Html figures;
    for (const Chart& chart : comparison_charts(report)) figures += html_figure(chart);
    page.sections.push_back({"figures", "Figures", figures});
  }
  page.sections.push_back({"measurement", "The two measurements", measurement_table(report)});
  Html provenance = html_element("h3", html_text("Before: " + report.before.name));
  provenance += html_provenance(report.before.provenance);
  provenance += html_element("h3", html_text("After: " + report.after.name));
  provenance += html_provenance(report.after.provenance);
  page.sections.push_back({"provenance", "Provenance", provenance});
  return page;
}

std::vector<Chart> comparison_charts(const ComparisonReport& report) {
  const PaperData data = comparison_data(report);
  if (shared_errors(data).index.empty()) return {};
  const std::size_t after = data.methods.size() - 1;
  std::vector<Chart> charts{method_deviation_chart(data, after), all_ranges_chart(data)};
  charts[0].title = "Absolute deviations per pose before and after";
  charts[1].title = "Error ranges before and after";
  if (promise_of(data) != nullptr) {
    charts.push_back(method_deviation_chart(data, 0));
    charts.back().title = "Absolute deviations per pose before and as promised";
  }
  for (Chart& chart : charts) chart.id = "comparison_" + chart.id;
  return charts;
}

}  // namespace hexcal
