#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/statistics.h"
#include "tools/report/chart.h"
#include "tools/report/html_page.h"

namespace hexcal {

/// What one method leaves of the poses' errors. Poses without an entry were dropped by that method (out of
/// the workspace after compensation, near singular) or not measured.
struct MethodPoses {
  std::string name;  ///< "option1", "kinematic"
  std::string note;  ///< how the poses came about: "cross-validated", "measured again"
  std::vector<std::optional<PosePair>> pairs;  ///< per pose of the campaign, in its order
  bool has_figures = true;  ///< figures of its own; else it stands in the tables and the figures of all
};

/// What the paper's figures 9 to 18 and tables 2 to 4 are drawn from (Karmakar and Turner, section 3).
struct PaperData {
  std::vector<std::string> pose_ids;
  std::vector<std::optional<Vector6d>> sigma;  ///< of the measured poses, mm and rad
  MethodPoses before;
  std::vector<MethodPoses> methods;
};

/// Figure 9: absolute errors of the measured poses, per pose, with one-sigma bars.
[[nodiscard]] Chart absolute_error_chart(const PaperData& data);
/// Figure 10: error ranges before compensation.
[[nodiscard]] Chart uncalibrated_range_chart(const PaperData& data);
/// Figures 11, 13, 15: error ranges before and after method `index`, over the poses that it keeps.
[[nodiscard]] Chart method_range_chart(const PaperData& data, std::size_t index);
/// Figures 12, 14, 16: absolute deviation of each parameter per pose before and after method `index`.
[[nodiscard]] Chart method_deviation_chart(const PaperData& data, std::size_t index);
/// Figure 17: improvement of the eq. 7 magnitudes of all methods, each over the poses that it keeps.
[[nodiscard]] Chart improvement_chart(const PaperData& data);
/// Figure 18: error ranges before and after every method, over the poses that all keep.
[[nodiscard]] Chart all_ranges_chart(const PaperData& data);
/// All of them in the paper's order, 11 to 16 for the methods that have figures of their own.
[[nodiscard]] std::vector<Chart> paper_charts(const PaperData& data);

/// Tables 2 to 4 in one: eq. 7 magnitudes before and after each method and the improvement.
[[nodiscard]] HtmlTable magnitude_table(const PaperData& data);
/// All methods over the poses that every one of them keeps: true rms and maximum, position and orientation.
[[nodiscard]] HtmlTable fair_table(const PaperData& data);

}  // namespace hexcal
