#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/report/markup.h"
#include "tools/report/report_sections.h"
#include "tools/report/svg_canvas.h"

namespace hexcal {
namespace {

// Arrows are stretched until a typical one is this share of the frame's width.
constexpr double kTypicalArrowShare = 0.02;

double typical_length(const std::vector<Arrow>& arrows) {
  std::vector<double> lengths;
  for (const Arrow& arrow : arrows) lengths.push_back(arrow.by.norm());
  if (lengths.empty()) return 0;
  const auto place = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() * 4 / 5);
  std::nth_element(lengths.begin(), place, lengths.end());
  return *place;
}

// 1, 2 or 5 times a power of ten, not above `value`.
double round_down(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  const double share = value / power;
  return power * (share >= 5 ? 5 : share >= 2 ? 2 : 1);
}

std::string base64(const std::string& bytes) {
  static constexpr char kAlphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group = (group << 8U) | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      out += k <= bytes.size() - i ? kAlphabet[(group >> (18U - 6U * k)) & 63U] : '=';
    }
  }
  return out;
}

double arrow_stretch(const NetworkPart& network) {
  std::vector<Arrow> all;
  Eigen::Vector2d size = Eigen::Vector2d::Zero();
  for (const PhotographPart& photograph : network.photographs) {
    all.insert(all.end(), photograph.residuals.begin(), photograph.residuals.end());
    size = size.cwiseMax(photograph.size_px);
  }
  const double typical = typical_length(all);
  return typical > 0 && size.x() > 0 ? round_down(kTypicalArrowShare * size.x() / typical) : 1;
}

// The photograph (or its empty frame) with markers and stretched residuals drawn in.
Html photograph_figure(const PhotographPart& photograph, double stretch) {
  constexpr double kWidth = 320;
  const double scale = kWidth / std::max(photograph.size_px.x(), 1.0);
  const Eigen::Vector2d size = scale * photograph.size_px;
  SvgCanvas canvas;
  for (const auto& [corners, used] : photograph.outlines) {
    std::vector<Eigen::Vector2d> points;
    for (const Eigen::Vector2d& corner : corners) points.push_back(scale * corner);
    points.push_back(points.front());
    canvas.polyline(points, {{used ? Ink::series2 : Ink::series1}, 1.4, !used});
  }
  for (const Arrow& arrow : photograph.residuals) {
    canvas.line(scale * arrow.from, scale * (arrow.from + stretch * arrow.by), {{Ink::series3}, 1});
  }
  std::string svg = canvas.inline_svg(size, photograph.name + " with its markers");
  if (!photograph.thumbnail_jpeg.empty()) {
    const std::string image =
        fmt::format("<image width=\"{:.1f}\" height=\"{:.1f}\" href=\"data:image/jpeg;base64,{}\"/>",
                    size.x(), size.y(), base64(photograph.thumbnail_jpeg));
    svg.insert(svg.find("</title>") + 8, image);
  }
  std::string caption = fmt::format("{}: {} markers, {} px rms", photograph.name, photograph.markers,
                                    significant_text(photograph.rms_px, 2));
  if (photograph.rejected > 0) caption += fmt::format(", {} rejected", photograph.rejected);
  if (photograph.status != "ok") caption = photograph.name + ": " + photograph.status;
  return html_element("figure", {svg + html_element("figcaption", html_text(caption)).source});
}

}  // namespace

Chart residual_chart(const NetworkPart& network) {
  Panel panel;
  panel.photograph_frame = true;
  panel.x.title = "x (px)";
  panel.y.title = "y (px)";
  Eigen::Vector2d size = Eigen::Vector2d::Zero();
  for (const PhotographPart& photograph : network.photographs) {
    size = size.cwiseMax(photograph.size_px);
    for (Arrow arrow : photograph.residuals) {
      arrow.tip = fmt::format("{}: {} px", photograph.name, significant_text(arrow.by.norm(), 2));
      panel.arrows.push_back(std::move(arrow));
    }
  }
  panel.x.low = 0, panel.x.high = size.x();
  panel.y.low = 0, panel.y.high = size.y();
  panel.arrow_scale = arrow_stretch(network);
  panel.arrow_key = round_down(std::max(0.06 * size.x() / panel.arrow_scale, 1e-12));
  panel.arrow_unit = "px";
  Chart chart;
  chart.id = "residual_vectors";
  chart.title = "Residual vectors over the frame";
  chart.caption = fmt::format(
      "Observed minus projected corners of all photographs, {} times enlarged. Arrows that point in all "
      "directions are "
      "noise; a pattern (a swirl, all outwards) is a camera that does not fit.",
      significant_text(panel.arrow_scale, 1));
  chart.panels = {panel};
  chart.panel_size = {880, 600};
  return chart;
}

Html network_section(const NetworkPart& network) {
  Html out = html_facts(
      {{"photographs", std::to_string(network.photographs.size())},
       {"residuals", significant_text(network.rms_px, 3) + " px rms"},
       {"sigma0", significant_text(network.sigma0, 3) + " (1: corners are as good as their sigmas say)"},
       {"redundancy", significant_text(network.redundancy, 3)}});
  const bool with_residuals =
      std::any_of(network.photographs.begin(), network.photographs.end(),
                  [](const PhotographPart& photograph) { return !photograph.residuals.empty(); });
  if (with_residuals) out += html_figure(residual_chart(network));
  HtmlTable table;
  table.caption = "Photographs";
  table.columns = {{"photograph", "", false, ""}, {"pose", "", false, ""},
                   {"status", "", false, ""},     {"markers", "", true, ""},
                   {"rejected", "", true, ""},    {"residual", "px rms", true, ""}};
  Html pictures;
  const double stretch = arrow_stretch(network);
  for (const PhotographPart& photograph : network.photographs) {
    HtmlCell name, pose, status;
    name.text = photograph.name;
    pose.text = photograph.pose_id;
    status.text = photograph.status;
    status.light = photograph.status == "ok" ? Light::good : Light::bad;
    table.rows.push_back({name, pose, status, number_cell(photograph.markers, 0),
                          number_cell(photograph.rejected, 0), number_cell(photograph.rms_px, 3)});
    if (photograph.size_px.x() > 0) pictures += photograph_figure(photograph, stretch);
  }
  out += html_table(table);
  out += html_element("h3", html_text("Every photograph"));
  out +=
      html_paragraph("Green: markers used; vermilion, dashed: rejected; pink: residuals, enlarged as above.");
  out += html_element("div", pictures, {{"class", "photographs"}});
  return out;
}

}  // namespace hexcal
