#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "tools/report/report_sections.h"

namespace hexcal {
namespace {

std::map<std::string, Pose> poses_by_id(const std::vector<PoseRecord>& records) {
  std::map<std::string, Pose> out;
  for (const PoseRecord& record : records) {
    if (record.pose) out[record.id] = *record.pose;
  }
  return out;
}

// What cross-validation expects to remain at each pose after compensation by one method. Poses whose
// corrected command leaves the workspace are dropped, as in the paper.
MethodPoses method_poses(const CompensationPart& part, const CrossValidation& method,
                         const std::vector<std::string>& pose_ids) {
  const auto& evaluations = part.calibration.evaluations;
  const auto evaluation = std::find_if(evaluations.begin(), evaluations.end(),
                                       [&](const PaperEvaluation& one) { return one.method == method.name; });
  MethodPoses out;
  out.name = method.name;
  out.note = "cross-validated";
  out.pairs.resize(pose_ids.size());
  for (std::size_t i = 0; i < method.held_out.size(); ++i) {
    const std::string& id = part.observations.poses.at(method.held_out_index.at(i)).id;
    if (evaluation != evaluations.end() &&
        std::find(evaluation->dropped.begin(), evaluation->dropped.end(), id) != evaluation->dropped.end()) {
      continue;
    }
    const auto place = std::find(pose_ids.begin(), pose_ids.end(), id);
    if (place != pose_ids.end())
      out.pairs[static_cast<std::size_t>(place - pose_ids.begin())] = method.held_out[i];
  }
  return out;
}

}  // namespace

PaperData paper_data(const CampaignReport& report) {
  PaperData data;
  data.before.name = "before";
  const std::map<std::string, Pose> targets = poses_by_id(report.targets);
  // What no method is judged on is no part of "before" either: all rows and figures stand over one set.
  std::set<std::string> left_out;
  if (report.compensation) {
    const CalibrationReport& calibration = report.compensation->calibration;
    left_out.insert(calibration.outliers.begin(), calibration.outliers.end());
    left_out.insert(calibration.unexplained.begin(), calibration.unexplained.end());
  }
  for (const PoseRecord& record : report.poses) {
    const auto target = targets.find(record.id);
    if (target == targets.end()) continue;
    data.pose_ids.push_back(record.id);
    data.sigma.push_back(record.sigma);
    // The home that defines LG is zero by definition, no measurement of an error.
    const bool defines =
        record.pose && record.sigma && record.sigma->isZero(0) && record.pose->vector().isZero(0);
    const bool counts = !is_suspect(record.status) && !defines && left_out.count(record.id) == 0;
    data.before.pairs.push_back(record.pose && counts ? std::optional(PosePair{target->second, *record.pose})
                                                      : std::nullopt);
  }
  if (report.compensation) {
    for (const CrossValidation& method : report.compensation->calibration.comparison.methods) {
      // No compensation leaves what was measured: that is `before`.
      if (!method.failure.empty() || method.method == CompensationMethod::nominal) continue;
      data.methods.push_back(method_poses(*report.compensation, method, data.pose_ids));
      data.methods.back().has_figures = method.method != CompensationMethod::kinematic ||
                                        method.name == report.compensation->calibration.chosen;
    }
  }
  return data;
}

HtmlPage campaign_page(const CampaignReport& report) {
  HtmlPage page;
  page.title = "hexcal: " + report.name;
  std::size_t measured = 0;
  for (const PoseRecord& record : report.poses) measured += record.pose ? 1 : 0;
  page.subtitle = fmt::format("{} of {} poses measured", measured, report.poses.size());
  page.verdict = html_verdict(report.verdict);
  if (!report.poses.empty()) page.sections.push_back({"poses", "Poses", poses_section(report)});
  if (!paper_data(report).pose_ids.empty()) {
    page.sections.push_back({"methods", "Errors and methods", methods_section(report)});
  } else if (!report.poses.empty()) {
    page.sections.push_back(
        {"methods", "Errors and methods",
         html_paragraph("No pose has a target: name `targets` in campaign.yaml to see errors.")});
  }
  if (report.compensation) {
    page.sections.push_back({"machine", "Machine", machine_section(*report.compensation)});
  } else if (!report.no_compensation.empty()) {
    page.sections.push_back({"machine", "Machine", html_paragraph(report.no_compensation)});
  }
  if (report.network) {
    page.sections.push_back({"view", "3D view", html_scene(report.network->scene)});
    page.sections.push_back({"network", "Residuals", network_section(*report.network)});
    page.sections.push_back({"photographs", "Photographs", photographs_section(*report.network)});
    page.with_scene = true;
  } else if (!report.no_network.empty()) {
    page.sections.push_back({"photographs", "Photographs", html_paragraph(report.no_network)});
  }
  for (std::size_t i = 0; i < report.cameras.size(); ++i) {
    const std::string number = report.cameras.size() > 1 ? fmt::format("-{}", i + 1) : "";
    page.sections.push_back({"camera" + number,
                             report.cameras.size() > 1 ? fmt::format("Camera {}", i + 1) : "Camera",
                             camera_section(report.cameras[i])});
  }
  page.sections.push_back({"provenance", "Provenance", html_provenance(report.provenance)});
  return page;
}

std::vector<Chart> campaign_charts(const CampaignReport& report) {
  std::vector<Chart> charts;
  const PaperData data = paper_data(report);
  if (!data.pose_ids.empty()) charts = paper_charts(data);
  if (report.compensation && report.compensation->calibration.identifiability) {
    const Chart chart = correction_chart(*report.compensation->calibration.identifiability);
    if (!chart.panels.empty()) charts.push_back(chart);
  }
  if (report.network && has_residuals(*report.network)) charts.push_back(residual_chart(*report.network));
  if (!report.cameras.empty()) charts.push_back(distortion_chart(report.cameras[0].camera));
  return charts;
}

}  // namespace hexcal
