#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tools/report/axis_ticks.h"
#include "tools/report/markup.h"
#include "tools/report/report_sections.h"

namespace hexcal {
namespace {

// Arrows are stretched until a long one is this share of the frame's width.
constexpr double kTypicalArrowShare = 0.02;
// Cells across the frame for the mean residuals; as many down as keeps them square.
constexpr int kCellsAcross = 12;
// A mean of fewer corners says little.
constexpr int kFewestInCell = 8;

Eigen::Vector2d frame_size(const NetworkPart& network) {
  Eigen::Vector2d size = Eigen::Vector2d::Zero();
  for (const PhotographPart& photograph : network.photographs) size = size.cwiseMax(photograph.size_px);
  return size;
}

// The length that four of five arrows stay below.
double long_arrow(const std::vector<Arrow>& arrows) {
  std::vector<double> lengths;
  for (const Arrow& arrow : arrows) lengths.push_back(arrow.by.norm());
  if (lengths.empty()) return 0;
  const auto place = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() * 4 / 5);
  std::nth_element(lengths.begin(), place, lengths.end());
  return *place;
}

// The frame of a photograph with arrows in it, and the arrow in the key.
Panel frame_panel(const std::string& title, std::vector<Arrow> arrows, const Eigen::Vector2d& size,
                  double typical_share) {
  Panel panel;
  panel.title = title;
  panel.photograph_frame = true;
  panel.x.title = "x (px)";
  panel.y.title = "y (px)";
  panel.x.low = 0, panel.x.high = size.x();
  panel.y.low = 0, panel.y.high = size.y();
  const double typical = long_arrow(arrows);
  panel.arrow_scale = typical > 0 ? round_number_below(typical_share * size.x() / typical) : 1;
  panel.arrow_key = round_number_below(std::max(0.12 * size.x() / panel.arrow_scale, 1e-12));
  panel.arrow_unit = fmt::format("px (\xC3\x97{})", significant_text(panel.arrow_scale, 1));
  panel.arrows = std::move(arrows);
  return panel;
}

struct CellMean {
  Eigen::Vector2d at = Eigen::Vector2d::Zero();
  Eigen::Vector2d by = Eigen::Vector2d::Zero();
  double squares = 0;
  int count = 0;
};

// Mean residual of the corners in each cell of the frame: noise averages out there, a lens does not.
std::vector<Arrow> mean_arrows(const NetworkPart& network, const Eigen::Vector2d& size) {
  const double side = size.x() / kCellsAcross;
  std::map<std::pair<int, int>, CellMean> cells;
  for (const PhotographPart& photograph : network.photographs) {
    for (const CornerResidual& corner : photograph.residuals) {
      if (!corner.used) continue;
      CellMean& cell =
          cells[{static_cast<int>(corner.at_px.y() / side), static_cast<int>(corner.at_px.x() / side)}];
      cell.at += corner.at_px;
      cell.by += corner.by_px;
      cell.squares += corner.by_px.squaredNorm();
      ++cell.count;
    }
  }
  std::vector<Arrow> arrows;
  for (const auto& [place, cell] : cells) {
    if (cell.count < kFewestInCell) continue;
    const double noise = std::sqrt(cell.squares) / cell.count;
    Arrow arrow{cell.at / cell.count, cell.by / cell.count, Ink::series0, ""};
    if (arrow.by.norm() > 3 * noise) arrow.ink = Ink::series1;
    arrow.tip = fmt::format("mean of {} corners: {} px; noise alone would leave about {} px", cell.count,
                            significant_text(arrow.by.norm(), 2), significant_text(noise, 2));
    arrows.push_back(std::move(arrow));
  }
  return arrows;
}

std::vector<Arrow> all_arrows(const NetworkPart& network) {
  std::vector<Arrow> arrows;
  for (const PhotographPart& photograph : network.photographs) {
    for (const CornerResidual& corner : photograph.residuals) {
      if (corner.used) arrows.push_back({corner.at_px, corner.by_px, Ink::series0, ""});
    }
  }
  return arrows;
}

HtmlTable length_table(const NetworkPart& network) {
  HtmlTable table;
  table.caption =
      "Known lengths. A check took no part in the adjustment: its difference is an error of the "
      "measurement";
  table.columns = {{"length", "", false, ""},
                   {"measured", "mm", true, ""},
                   {"stated", "mm", true, ""},
                   {"difference", "mm", true, "measured minus stated"},
                   {"sigma", "mm", true, "one standard deviation of the measured length"}};
  for (const LengthPart& length : network.lengths) {
    const double measured = length.measured_mm.value_or(kNoNumber);
    table.rows.push_back({text_cell(length.name), number_cell(measured, 4), number_cell(length.stated_mm, 4),
                          number_cell(measured - length.stated_mm, 4),
                          number_cell(length.measured_mm ? length.sigma_mm : kNoNumber, 4)});
  }
  return table;
}

}  // namespace

bool has_residuals(const NetworkPart& network) {
  return std::ranges::any_of(network.photographs, [](const PhotographPart& photograph) {
    return !photograph.residuals.empty() && photograph.size_px.x() > 0;
  });
}

Chart residual_chart(const NetworkPart& network) {
  const Eigen::Vector2d size = frame_size(network);
  Chart chart;
  chart.id = "residual_vectors";
  chart.title = "Residual vectors over the frame";
  chart.caption =
      "Observed minus projected corners. Left, every corner of every photograph: arrows in all directions "
      "are "
      "noise. Right, the mean in each part of the frame; vermilion where it is more than three times what "
      "noise would leave. A pattern there (a swirl, all outwards) is a camera that does not fit.";
  chart.panels = {
      frame_panel("Every corner", all_arrows(network), size, kTypicalArrowShare),
      frame_panel("Mean per part of the frame", mean_arrows(network, size), size, 1.5 * kTypicalArrowShare)};
  chart.panel_size = {440, 350};
  return chart;
}

Html network_section(const NetworkPart& network) {
  std::vector<std::pair<std::string, std::string>> facts{
      {"photographs", std::to_string(network.photographs.size())},
      {"residuals", significant_text(network.rms_px, 3) + " px rms"},
      {"sigma0", significant_text(network.sigma0, 3) + " (1: corners are as good as their sigmas say)"},
      {"redundancy", fmt::format("{:.0f} (observations beyond those needed)", network.redundancy)}};
  for (const auto& [frame, words] : network.datums) facts.emplace_back("frame " + frame, words);
  Html out = html_facts(facts);
  if (has_residuals(network)) out += html_figure(residual_chart(network));
  if (!network.lengths.empty()) out += html_table(length_table(network));
  return out;
}

}  // namespace hexcal
