#include "tools/report/chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "tools/report/markup.h"
#include "tools/report/panel_frame.h"
#include "tools/report/pdf_canvas.h"
#include "tools/report/svg_canvas.h"

namespace hexcal {
namespace {

using Eigen::Vector2d;

double x_of(const Series& series, std::size_t i) {
  return series.x.empty() ? static_cast<double>(i) : series.x[i];
}

std::string tip_of(const Panel& panel, const Series& series, std::size_t i, double step) {
  if (!series.tips.empty()) return series.tips[i];
  std::string tip = series.name;
  if (!tip.empty()) tip += ", ";
  tip += i < panel.x.categories.size() ? panel.x.categories[i] : significant_text(x_of(series, i), 4);
  tip +=
      ": " + (panel.y.logarithmic ? significant_text(series.y[i], 3) : number_text(series.y[i], step / 100));
  if (!series.sigma.empty()) tip += " \xC2\xB1 " + number_text(series.sigma[i], step / 100);
  const std::size_t unit = panel.y.title.rfind('(');
  if (unit != std::string::npos)
    tip += ' ' + panel.y.title.substr(unit + 1, panel.y.title.rfind(')') - unit - 1);
  return tip;
}

void draw_sigma(const PanelFrame& frame, double x, double y, double sigma, Ink ink, Canvas& canvas) {
  // An axis with fixed ends may cut the bar.
  const Vector2d top = frame.pixel({x, std::min(y + sigma, frame.y.high)});
  const Vector2d bottom = frame.pixel({x, std::max(y - sigma, frame.y.low)});
  canvas.line(top, bottom, {{ink}, 1.2});
  for (const Vector2d& end : {top, bottom})
    canvas.line(end - Vector2d(2.5, 0), end + Vector2d(2.5, 0), {{ink}, 1.2});
}

void draw_bars(const Panel& panel, const PanelFrame& frame, Canvas& canvas) {
  const auto is_bars = [](const Series& series) { return series.kind == Series::Kind::bars; };
  const auto count = std::count_if(panel.series.begin(), panel.series.end(), is_bars);
  if (count == 0) return;
  const double width = 0.78 / static_cast<double>(count);
  double offset = -0.39;
  for (const Series& series : panel.series) {
    if (!is_bars(series)) continue;
    for (std::size_t i = 0; i < series.y.size(); ++i) {
      if (!std::isfinite(series.y[i])) continue;
      const double left = x_of(series, i) + offset;
      const Vector2d top = frame.pixel({left, std::max(series.y[i], 0.0)});
      const Vector2d bottom = frame.pixel({left + width, std::min(series.y[i], 0.0)});
      const double bar_px = bottom.x() - top.x();
      canvas.begin_tip(tip_of(panel, series, i, frame.y.step));
      canvas.rectangle(top, {std::max(bar_px - 1, 0.5), std::max(bottom.y() - top.y(), 0.6)}, {series.ink});
      if (!series.sigma.empty() && series.sigma[i] > 0) {
        draw_sigma(frame, left + width / 2, series.y[i], series.sigma[i], Ink::text, canvas);
      }
      std::string label = significant_text(series.y[i], 3);
      if (text_width(label, 8.5) > bar_px + 2) label = significant_text(series.y[i], 2);
      if (panel.value_labels && text_width(label, 8.5) <= bar_px + 2) {
        canvas.text({(top.x() + bottom.x()) / 2, series.y[i] < 0 ? bottom.y() + 9 : top.y() - 3}, label,
                    {8.5, Anchor::middle, {Ink::muted}});
      }
      canvas.end_tip();
    }
    offset += width;
  }
}

void draw_line(const Series& series, const PanelFrame& frame, Canvas& canvas) {
  std::vector<Vector2d> run, upper, lower;
  const auto flush = [&] {
    if (!upper.empty()) {
      upper.insert(upper.end(), lower.rbegin(), lower.rend());
      canvas.polygon(upper, {series.ink, 0.18});
    }
    if (run.size() > 1) {
      const bool thin = series.kind == Series::Kind::points;
      canvas.polyline(run, {{series.ink, thin ? 0.45 : 1.0}, thin ? 1.0 : 1.8, series.dashed});
    }
    run.clear(), upper.clear(), lower.clear();
  };
  for (std::size_t i = 0; i < series.y.size(); ++i) {
    if (!std::isfinite(series.y[i])) {
      flush();
      continue;
    }
    run.push_back(frame.pixel({x_of(series, i), series.y[i]}));
    if (series.kind == Series::Kind::line && !series.sigma.empty()) {
      upper.push_back(frame.pixel({x_of(series, i), series.y[i] + series.sigma[i]}));
      lower.push_back(frame.pixel({x_of(series, i), series.y[i] - series.sigma[i]}));
    }
  }
  flush();
}

void draw_points(const Panel& panel, const Series& series, const PanelFrame& frame, Canvas& canvas) {
  const double radius = series.y.size() > 60 ? 2.2 : 3;
  for (std::size_t i = 0; i < series.y.size(); ++i) {
    if (!std::isfinite(series.y[i])) continue;
    canvas.begin_tip(tip_of(panel, series, i, frame.y.step));
    if (!series.sigma.empty() && series.sigma[i] > 0) {
      draw_sigma(frame, x_of(series, i), series.y[i], series.sigma[i], series.ink, canvas);
    }
    draw_marker(canvas, frame.pixel({x_of(series, i), series.y[i]}), series.ink, radius);
    canvas.end_tip();
  }
}

void draw_cells(const Panel& panel, const PanelFrame& frame, Canvas& canvas) {
  for (const HeatCell& cell : panel.cells) {
    const Vector2d a = frame.pixel(cell.low);
    const Vector2d b = frame.pixel(cell.high);
    canvas.begin_tip(cell.tip.empty() ? significant_text(cell.value, 3) : cell.tip);
    const Paint paint =
        std::isfinite(cell.value)
            ? Paint{Ink::exact, 1,
                    heat_rgb((cell.value - frame.heat_low) / (frame.heat_high - frame.heat_low))}
            : Paint{Ink::grid};
    canvas.rectangle(a.cwiseMin(b), (a - b).cwiseAbs() + Vector2d::Constant(0.3), paint);
    canvas.end_tip();
  }
}

void draw_arrows(const Panel& panel, const PanelFrame& frame, Canvas& canvas) {
  std::map<Ink, std::vector<std::vector<Vector2d>>> plain;  // without tips: one element for all of an ink
  for (const Arrow& arrow : panel.arrows) {
    if (!arrow.from.allFinite() || !arrow.by.allFinite()) continue;
    if (arrow.tip.empty()) {
      plain[arrow.ink].push_back(
          {frame.pixel(arrow.from), frame.pixel(arrow.from + panel.arrow_scale * arrow.by)});
      continue;
    }
    const Vector2d from = frame.pixel(arrow.from);
    const Vector2d to = frame.pixel(arrow.from + panel.arrow_scale * arrow.by);
    canvas.begin_tip(arrow.tip);
    canvas.line(from, to, {{arrow.ink}, 1.2});
    canvas.circle(from, 1.6, {arrow.ink});
    canvas.end_tip();
  }
  for (const auto& [ink, lines] : plain) canvas.polylines(lines, {{ink, 0.7}, 0.8});
}

}  // namespace

Vector2d chart_size(const Chart& chart) {
  const int panels = std::max(static_cast<int>(chart.panels.size()), 1);
  const int columns = std::min(chart.columns, panels);
  return chart.panel_size.cwiseProduct(Vector2d(columns, (panels + columns - 1) / columns));
}

void draw_chart(const Chart& chart, Canvas& canvas) {
  canvas.rectangle({0, 0}, chart_size(chart), {Ink::surface});
  for (std::size_t i = 0; i < chart.panels.size(); ++i) {
    const Panel& panel = chart.panels[i];
    const auto columns = static_cast<std::size_t>(chart.columns);
    const Vector2d corner = chart.panel_size.cwiseProduct(
        Vector2d(static_cast<double>(i % columns), static_cast<double>(i / columns)));
    const PanelFrame frame(panel, corner, chart.panel_size);
    draw_cells(panel, frame, canvas);
    frame.draw(panel, canvas);
    draw_bars(panel, frame, canvas);
    for (const Series& series : panel.series) {
      if (series.kind != Series::Kind::bars) draw_line(series, frame, canvas);
    }
    for (const Series& series : panel.series) {
      if (series.kind == Series::Kind::points) draw_points(panel, series, frame, canvas);
    }
    draw_arrows(panel, frame, canvas);
  }
}

std::string chart_inline_svg(const Chart& chart) {
  SvgCanvas canvas;
  draw_chart(chart, canvas);
  return canvas.inline_svg(chart_size(chart), chart.title);
}

std::string chart_svg_file(const Chart& chart) {
  SvgCanvas canvas;
  draw_chart(chart, canvas);
  return canvas.svg_file(chart_size(chart), chart.title);
}

std::string chart_pdf_file(const Chart& chart) {
  PdfCanvas canvas(chart_size(chart), chart.title);
  draw_chart(chart, canvas);
  return canvas.finish();
}

std::uint32_t heat_rgb(double share) {
  static const std::array<Eigen::Vector3d, 6> kStops{
      Eigen::Vector3d(0, 34, 78),     Eigen::Vector3d(53, 69, 108),   Eigen::Vector3d(102, 105, 112),
      Eigen::Vector3d(148, 142, 119), Eigen::Vector3d(200, 184, 102), Eigen::Vector3d(254, 232, 56)};
  const double place = std::clamp(std::isfinite(share) ? share : 0.0, 0.0, 1.0) * (kStops.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(place), kStops.size() - 2);
  const Eigen::Vector3d colour =
      kStops[below] + (place - static_cast<double>(below)) * (kStops[below + 1] - kStops[below]);
  const auto channel = [&](Eigen::Index i) { return static_cast<std::uint32_t>(std::lround(colour[i])); };
  return (channel(0) << 16U) | (channel(1) << 8U) | channel(2);
}

}  // namespace hexcal
