#pragma once

#include <vector>

#include "tools/report/campaign_report.h"

namespace hexcal {

/// Two campaigns on one machine: before and after compensation, or two rounds of anything. Poses are paired
/// by name; each counts against its own campaign's target.
struct ComparisonReport {
  CampaignReport before, after;
};

/// Errors of the poses that both campaigns measured: before, what compensation promised after the first
/// campaign (where the machine was identified), and what was measured after.
[[nodiscard]] PaperData comparison_data(const ComparisonReport& report);

[[nodiscard]] Verdict comparison_verdict(const ComparisonReport& report);
[[nodiscard]] HtmlPage comparison_page(const ComparisonReport& report);
/// Every figure of the page, for a paper.
[[nodiscard]] std::vector<Chart> comparison_charts(const ComparisonReport& report);

}  // namespace hexcal
