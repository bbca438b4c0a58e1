#include "tools/hexcal/compensate_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tools/hexcal/error_tables.h"
#include "tools/hexcal/terminal.h"
#include "tools/io/json_text.h"

namespace hexcal {
namespace {

using Json = nlohmann::ordered_json;

std::string method_table(const CalibrationReport& report) {
  const auto& all = report.comparison.methods;
  const bool incomplete = std::ranges::any_of(all, [](const auto& m) { return m.predicted.has_value(); });
  std::vector<std::string> columns{"method",  "numbers", "rms_mm",  "+-",  "max_mm",
                                   "rms_deg", "+-",      "max_deg", "lost"};
  // Not all coordinates were measured: the error over all six can only be predicted.
  if (incomplete) columns.insert(columns.end(), {"predicted_mm", "predicted_deg"});
  TextTable text(columns);
  for (std::size_t i = 0; i < report.comparison.methods.size(); ++i) {
    const CrossValidation& method = report.comparison.methods[i];
    const bool chosen = method.name == report.chosen;
    const std::string label = fmt::format("{} {}", chosen ? "*" : " ", method.name);
    if (!method.failure.empty()) {
      text.add_row({label, std::to_string(method.complexity), method.failure}, Colour::dim);
      continue;
    }
    const ErrorStatistics& e = method.errors;
    std::vector<std::string> cells{
        label,
        std::to_string(method.complexity),
        decimal(e.position_rms_mm, 4),
        decimal(method.position_rms_se_mm, 4),
        decimal(e.position_max_mm, 4),
        decimal(e.orientation_rms_rad * kDegPerRad, 4),
        decimal(method.orientation_rms_se_rad * kDegPerRad, 4),
        decimal(e.orientation_max_rad * kDegPerRad, 4),
        i < report.evaluations.size() ? std::to_string(report.evaluations[i].dropped.size()) : "-"};
    if (incomplete && method.predicted) {
      cells.push_back(decimal(method.predicted->position_mm, 4));
      cells.push_back(decimal(method.predicted->orientation_rad * kDegPerRad, 4));
    }
    text.add_row(cells, chosen ? Colour::bold : Colour::plain);
  }
  return text.text();
}

std::string paper_table(const CalibrationReport& report) {
  if (report.common.empty()) return "no pose stays in the workspace with every method: no common table\n";
  std::vector<std::string> columns = paper_columns("the paper's ranges");
  columns.emplace_back("improvement");
  TextTable text(columns);
  const auto add = [&](const std::string& name, const ErrorStatistics& s, const std::string& improvement) {
    std::vector<std::string> cells = paper_row(name, s);
    cells.push_back(improvement);
    text.add_row(cells);
  };
  add("uncompensated", report.common_before, "");
  for (const PaperEvaluation& evaluation : report.evaluations) {
    const bool paper = evaluation.method.rfind("option", 0) == 0;
    if (!paper && evaluation.method != report.chosen) continue;
    if (evaluation.after_common.poses == 0) continue;
    // All rows over the same poses: the paper compares all poses before with those that were left after.
    const ErrorStatistics& before = report.common_before;
    const ErrorStatistics& after = evaluation.after_common;
    add(evaluation.method, after,
        fmt::format(
            "{} %, {} %",
            decimal(improvement_percent(before.position_magnitude_mm, after.position_magnitude_mm), 1),
            decimal(improvement_percent(before.orientation_magnitude_rad, after.orientation_magnitude_rad),
                    1)));
  }
  return text.text();
}

std::string diagnosis(const CalibrationReport& report) {
  const IdentifyResult& identified = *report.fitted.identified;
  const Identifiability& judged = *report.identifiability;
  std::string text = fmt::format(
      "identified {} numbers: rank {}, {} known from the data, {:.1f} effective, condition {:.3g}, "
      "sigma0 {:.2f}\n",
      judged.free_parameters, judged.rank, judged.determined, identified.effective_parameters,
      judged.condition, identified.sigma0_of_measurement);
  text += fmt::format("noise: {:.4g} mm, {:.4g} deg per measured coordinate, legs {:.4g} mm\n",
                      identified.position_sigma_mm, identified.orientation_sigma_rad * kDegPerRad,
                      identified.leg_sigma_mm);
  if (identified.drift) {
    text +=
        coloured(fmt::format("! {}: {}\n", identified.drift->sentence(), kDriftInstruction), Colour::warning);
  }
  for (const LegDiagnosis& leg : judged.legs)
    text += fmt::format("{} {}\n", leg.wrong ? "!" : " ", leg.sentence);
  for (const std::string& sentence : judged.beyond_geometry) text += fmt::format("  {}\n", sentence);
  for (std::size_t i = 0; i < std::min<std::size_t>(3, judged.correlations.size()); ++i) {
    const CorrelatedPair& pair = judged.correlations[i];
    text += fmt::format("  {} and {} cannot be told apart (correlation {:+.3f})\n", pair.a, pair.b,
                        pair.correlation);
  }
  if (!judged.advice.empty()) text += judged.advice + "\n";
  return text;
}

const char* status_name(CommandStatus status) {
  switch (status) {
    case CommandStatus::ok:
      return "ok";
    case CommandStatus::out_of_stroke:
      return "out_of_stroke";
    case CommandStatus::joint_limit:
      return "joint_limit";
    case CommandStatus::no_pose:
      return "no_pose";
    case CommandStatus::withheld:
      return "withheld";
  }
  return "";
}

// JSON has no infinity.
Json finite(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json identified_json(const CalibrationReport& report) {
  const IdentifyResult& identified = *report.fitted.identified;
  const Identifiability& judged = *report.identifiability;
  Json out{{"free_parameters", judged.free_parameters},
           {"rank", judged.rank},
           {"determined", judged.determined},
           {"effective_parameters", identified.effective_parameters},
           {"condition", finite(judged.condition)},
           {"sigma0", identified.sigma0_of_measurement},
           {"position_sigma_mm", identified.position_sigma_mm},
           {"orientation_sigma_deg", identified.orientation_sigma_rad * kDegPerRad},
           {"leg_sigma_mm", identified.leg_sigma_mm},
           {"advice", judged.advice},
           {"beyond_geometry", judged.beyond_geometry}};
  if (identified.drift) {
    out["drift"] = {{"motion_mm_deg", json_mm_deg(identified.drift->motion)}, {"f", identified.drift->f}};
  }
  for (const char* list : {"parameters", "correlations", "weak", "legs", "poses"}) out[list] = Json::array();
  for (const ParameterReport& p : judged.parameters)
    out["parameters"].push_back({{"name", p.name},
                                 {"unit", p.unit},
                                 {"correction", p.value},
                                 {"sigma", p.sigma},
                                 {"tolerance", finite(p.tolerance)}});
  for (const CorrelatedPair& pair : judged.correlations)
    out["correlations"].push_back({{"a", pair.a}, {"b", pair.b}, {"correlation", pair.correlation}});
  for (const WeakDirection& weak : judged.weak)
    out["weak"].push_back({{"gain", weak.gain}, {"parameters", weak.parameters}});
  for (const LegDiagnosis& leg : judged.legs)
    out["legs"].push_back({{"leg", leg.leg}, {"wrong", leg.wrong}, {"diagnosis", leg.sentence}});
  for (std::size_t i = 0; i < identified.pose_residuals.size(); ++i)
    out["poses"].push_back({{"pose", report.fitted_ids[i]},
                            {"residual_mm_deg", json_mm_deg(identified.pose_residuals[i])},
                            {"weight", identified.weights[i]},
                            {"influence", identified.influence[i]}});
  return out;
}

}  // namespace

std::string compensation_text(const CalibrationReport& report, const ObservationTable& table,
                              const std::vector<CorrectedCommand>& commands,
                              const std::vector<std::filesystem::path>& written) {
  const MethodComparison& comparison = report.comparison;
  std::string text = fmt::format(
      "error that would remain after compensation at poses not used ({}), measuring noise included\n",
      comparison.leave_one_out ? "leave-one-out" : fmt::format("{}-fold cross-validation", comparison.folds));
  text += method_table(report);
  text += report.why + "\n";
  if (report.doubt) {
    text += coloured(fmt::format("no command is given: {}\n", report.doubt->cause()), Colour::bad);
    text += fmt::format("next: {}\n", report.doubt->instruction);
  }
  if (report.uncompensated && !report.evaluations.empty()) text += fmt::format("\n{}", paper_table(report));
  if (!report.outliers.empty())
    text += fmt::format("left out as near-singular outliers: {}\n", fmt::join(report.outliers, ", "));
  if (!report.unexplained.empty())
    text += fmt::format("fit no method and are left out of the comparison: {}\n",
                        fmt::join(report.unexplained, ", "));
  for (const auto& pose : table.left_out) text += fmt::format("left out {}: {}\n", pose.id, pose.reason);
  if (report.identifiability) text += fmt::format("\n{}", diagnosis(report));
  int failed = 0;
  for (const CorrectedCommand& command : commands) {
    if (command.status == CommandStatus::ok) continue;
    if (report.doubt) break;  // one reason for all, stated above
    if (++failed <= 10) text += fmt::format("{}: {}\n", command.id, command.reason);
  }
  if (failed > 10) text += fmt::format("and {} more targets that cannot be reached\n", failed - 10);
  double squares_mm = 0;
  double squares_rad = 0;
  int with_sigma = 0;
  for (const CorrectedCommand& command : commands) {
    if (!command.sigma) continue;
    squares_mm += command.sigma->head<3>().squaredNorm();
    squares_rad += command.sigma->tail<3>().squaredNorm();
    ++with_sigma;
  }
  if (with_sigma > 0) {
    text += fmt::format("predicted error at the {} targets after compensation: {:.4f} mm, {:.4f} deg rms\n",
                        with_sigma, std::sqrt(squares_mm / with_sigma),
                        std::sqrt(squares_rad / with_sigma) * kDegPerRad);
  }
  return text + written_line(written);
}

std::string compensation_json(const CalibrationReport& report, const ObservationTable& table,
                              const std::vector<CorrectedCommand>& commands,
                              const std::vector<std::filesystem::path>& written) {
  Json out{{"chosen", report.chosen},
           {"why", report.why},
           {"leave_one_out", report.comparison.leave_one_out},
           {"folds", report.comparison.folds}};
  for (const char* list : {"methods", "left_out", "commands", "written"}) out[list] = Json::array();
  for (std::size_t i = 0; i < report.comparison.methods.size(); ++i) {
    const CrossValidation& method = report.comparison.methods[i];
    Json entry{{"name", method.name}, {"numbers", method.complexity}};
    if (!method.failure.empty()) {
      entry["failure"] = method.failure;
    } else {
      entry["cross_validated"] = error_json(method.errors);
      entry["position_rms_se_mm"] = finite(method.position_rms_se_mm);
      entry["orientation_rms_se_deg"] = finite(method.orientation_rms_se_rad * kDegPerRad);
      if (method.predicted) {
        entry["predicted_over_all"] = {{"position_mm", method.predicted->position_mm},
                                       {"orientation_deg", method.predicted->orientation_rad * kDegPerRad}};
      }
    }
    if (i < report.evaluations.size()) {
      entry["lost"] = report.evaluations[i].dropped;
      entry["valid_before"] = error_json(report.evaluations[i].before);
      entry["valid_after"] = error_json(report.evaluations[i].after);
      entry["common_after"] = error_json(report.evaluations[i].after_common);
    }
    out["methods"].push_back(entry);
  }
  if (report.uncompensated) {
    out["uncompensated"] = error_json(*report.uncompensated);
    out["common"] = report.common;
    out["common_before"] = error_json(report.common_before);
  }
  out["outliers"] = report.outliers;
  out["unexplained"] = report.unexplained;
  if (report.doubt) {
    out["doubt"] = {{"cause", report.doubt->cause()},
                    {"slip", report.doubt->slip},
                    {"instruction", report.doubt->instruction}};
  }
  for (const auto& pose : table.left_out)
    out["left_out"].push_back({{"pose", pose.id}, {"reason", pose.reason}});
  if (report.identifiability) out["identified"] = identified_json(report);
  for (const CorrectedCommand& command : commands) {
    Json entry{{"pose", command.id}, {"status", status_name(command.status)}};
    if (!command.reason.empty()) entry["reason"] = command.reason;
    if (command.sigma) entry["sigma_mm_deg"] = json_mm_deg(*command.sigma);
    out["commands"].push_back(entry);
  }
  for (const auto& path : written) out["written"].push_back(path.string());
  return json_text(out, 2) + "\n";
}

}  // namespace hexcal
