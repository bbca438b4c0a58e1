#include "tools/hexcal/measurement_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "pose_extract/pose_verdict.h"
#include "tools/hexcal/command.h"
#include "tools/hexcal/terminal.h"
#include "tools/io/measured_poses.h"

namespace hexcal {
namespace {

constexpr int kShownRemarks = 10;

// One line per file; files left out for one reason in a row are one line.
std::string skipped_lines(const std::vector<SkippedFile>& skipped) {
  std::string out;
  for (std::size_t first = 0; first < skipped.size();) {
    std::size_t last = first;
    while (last + 1 < skipped.size() && skipped[last + 1].reason == skipped[first].reason) ++last;
    out += last < first + 3 ? fmt::format("not used: {}: {}\n", skipped[first].name, skipped[first].reason)
                            : fmt::format("not used: {} files from {} to {}: {}\n", last - first + 1,
                                          skipped[first].name, skipped[last].name, skipped[first].reason);
    first = last < first + 3 ? first + 1 : last + 1;
  }
  return out;
}

std::string length_line(const char* kind, const MeasuredLength& length) {
  const auto name = [](const MarkerPoint& point) {
    return point.corner < 0 ? fmt::format("{}", point.id) : fmt::format("{}.{}", point.id, point.corner);
  };
  if (!length.measured)
    return fmt::format("{} {}-{}: not measured\n", kind, name(length.known.a), name(length.known.b));
  return fmt::format("{} {}-{}: measured {:.4f} mm (sigma {:.4f}), stated {:.4f}, difference {:+.4f} mm\n",
                     kind, name(length.known.a), name(length.known.b), length.length_mm, length.sigma_mm,
                     length.known.length_mm, length.length_mm - length.known.length_mm);
}

}  // namespace

std::string measurement_text(const CampaignMeasurement& measurement) {
  const auto& [open, observations, result] = measurement;
  std::string out;
  TextTable table({"pose", "x_mm", "y_mm", "z_mm", "roll_deg", "pitch_deg", "yaw_deg", "sigma_um",
                   "sigma_mdeg", "photos", "markers", "rms_px", "status"});
  table.align_left(12);
  int bad = 0;
  int suspects = 0;
  for (const MeasuredPose& pose : result.poses) {
    std::vector<std::string> cells{pose.id};
    const bool ok = pose.status == PoseStatus::ok;
    for (int i = 0; i < 6; ++i)
      cells.push_back(pose.pose ? fmt::format("{:.4f}", mm_deg(pose.pose->vector())[i]) : "");
    if (pose.pose) {
      const Vector6d sigma = mm_deg(pose_sigmas(pose));
      cells.push_back(fmt::format("{:.2f}", sigma.head<3>().maxCoeff() * 1e3));
      cells.push_back(fmt::format("{:.2f}", sigma.tail<3>().maxCoeff() * 1e3));
    } else {
      cells.insert(cells.end(), {"", ""});
    }
    cells.push_back(fmt::format("{}", pose.images));
    cells.push_back(fmt::format("{}", pose.markers));
    cells.push_back(pose.pose ? fmt::format("{:.4f}", pose.rms_px) : "");
    std::string words = status_text(pose);
    if (ok && !pose.words.empty()) words += " (" + pose.words + ")";
    cells.push_back(words);
    const bool doubtful = pose.status == PoseStatus::suspect || (ok && !pose.words.empty());
    table.add_row(std::move(cells), doubtful ? Colour::warning : ok ? Colour::plain : Colour::bad);
    bad += ok ? 0 : 1;
    suspects += pose.status == PoseStatus::suspect ? 1 : 0;
  }
  if (!result.poses.empty()) out += table.text();
  const AdjustmentResult& adjusted = result.adjusted;
  int used = 0;
  int remarked = 0;
  std::size_t worst = 0;
  for (std::size_t p = 0; p < result.photographs.size(); ++p) {
    const MeasuredPhotograph& photograph = result.photographs[p];
    if (is_used(photograph.status)) ++used;
    if (photograph.residuals.worst_px > result.photographs[worst].residuals.worst_px) worst = p;
    if (photograph.status != PhotoStatus::ok) {
      out += fmt::format("photograph {}: {}: {}\n", observations.photographs[p].seen.name,
                         photo_status_name(photograph.status), photograph.words);
    } else if (!photograph.words.empty() && ++remarked <= kShownRemarks) {
      out += fmt::format("photograph {}: {}\n", observations.photographs[p].seen.name, photograph.words);
    }
  }
  if (remarked > kShownRemarks)
    out += fmt::format("and {} more photographs with remarks, see quality.json\n", remarked - kShownRemarks);
  out += skipped_lines(open.listing.skipped);
  for (const MeasuredLength& bar : result.bars) out += length_line("bar", bar);
  for (const MeasuredLength& check : result.checks) out += length_line("check", check);
  for (const Finding& finding : result.findings) {
    const bool problem = finding.severity == Severity::bad;
    out += fmt::format("{}: {}\n",
                       coloured(problem                                 ? "problem"
                                : finding.severity == Severity::warning ? "warning"
                                                                        : "note",
                                problem ? Colour::bad : Colour::plain),
                       finding_text(finding));
  }
  out += fmt::format("{} of {} poses{}, {} of {} photographs",
                     result.poses.size() - static_cast<std::size_t>(bad), result.poses.size(),
                     suspects > 0 ? fmt::format(" ({} more are suspect)", suspects) : "", used,
                     result.photographs.size());
  if (!result.photographs.empty() && adjusted.redundancy_total > 0) {
    out += fmt::format(
        "; sigma0 {:.3f} at redundancy {:.0f}, rms {:.4f} px, worst corner {:.4f} px in {}; markers {}",
        adjusted.sigma0, adjusted.redundancy_total, adjusted.rms_px,
        result.photographs[worst].residuals.worst_px, observations.photographs[worst].seen.name,
        adjusted.shape_free ? "with free corners" : "as rigid squares");
  }
  return out + "\n";
}

int measurement_exit_code(const CampaignResult& result) {
  const bool all_ok = std::ranges::all_of(result.photographs, [](const MeasuredPhotograph& photograph) {
    return photograph.status == PhotoStatus::ok;
  });
  const bool poses_ok = !result.has_moving || std::ranges::all_of(result.poses, [](const MeasuredPose& pose) {
    return pose.status == PoseStatus::ok;
  });
  return all_ok && poses_ok && overall_verdict(result) != Severity::bad ? kDone : kSomeFailed;
}

}  // namespace hexcal
