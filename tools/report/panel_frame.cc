#include "tools/report/panel_frame.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tools/report/markup.h"

namespace hexcal {
namespace {

constexpr double kLabelSize = 10.5;
constexpr double kTitleSize = 12.5;
constexpr double kLegendRow = 17;
constexpr double kHeatKeyWidth = 62;
constexpr Paint kMuted{Ink::muted};

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void add(double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

struct DataRange {
  Range x, y;
};

DataRange data_range(const Panel& panel) {
  DataRange range;
  for (const Series& series : panel.series) {
    for (std::size_t i = 0; i < series.y.size(); ++i) {
      const double sigma = series.sigma.empty() || !std::isfinite(series.sigma[i]) ? 0 : series.sigma[i];
      range.y.add(series.y[i] - sigma);
      range.y.add(series.y[i] + sigma);
      range.x.add(series.x.empty() ? static_cast<double>(i) : series.x[i]);
    }
    if (series.kind == Series::Kind::bars) range.y.add(0);
  }
  for (const HeatCell& cell : panel.cells) {
    range.x.add(cell.low.x());
    range.x.add(cell.high.x());
    range.y.add(cell.low.y());
    range.y.add(cell.high.y());
  }
  for (const Arrow& arrow : panel.arrows) {
    range.x.add(arrow.from.x());
    range.y.add(arrow.from.y());
  }
  if (!panel.x.categories.empty()) range.x = {-0.5, static_cast<double>(panel.x.categories.size()) - 0.5};
  return range;
}

// Decades that hold all values above zero.
AxisTicks decades_of(const Panel& panel) {
  Range range;
  for (const Series& series : panel.series) {
    for (const double value : series.y) {
      if (value > 0) range.add(std::log10(value));
    }
  }
  const double low = std::isfinite(range.low) ? std::floor(range.low) : 0;
  return {low, std::max(std::ceil(range.high), low + 1), 1};
}

AxisTicks ticks_of(const Axis& axis, const Range& data, int wanted, bool tight) {
  double low = axis.low.value_or(data.low);
  const double high = axis.high.value_or(data.high);
  // An axis that nearly reaches zero had better show it: lengths then compare.
  if (!axis.low && low > 0 && low < 0.5 * high) low = 0;
  return tight || (axis.low && axis.high) ? axis_ticks_within(low, high, wanted)
                                          : axis_ticks(low, high, wanted);
}

// A pose may have any name; a label has room for so much.
std::string shortened(const std::string& label) {
  constexpr std::size_t kLongest = 18;
  if (label.size() <= kLongest) return label;
  std::size_t end = kLongest - 1;
  while (end > 0 && (static_cast<unsigned char>(label[end]) & 0xC0U) == 0x80U) --end;
  return label.substr(0, end) + "\xE2\x80\xA6";
}

double widest(const std::vector<std::string>& words) {
  double width = 0;
  for (const std::string& word : words) width = std::max(width, text_width(shortened(word), kLabelSize));
  return width;
}

// Rows of legend entries: index of the first series of each row.
std::vector<std::vector<std::size_t>> legend_rows(const Panel& panel, double width) {
  std::vector<std::vector<std::size_t>> rows;
  double used = width;
  for (std::size_t i = 0; i < panel.series.size(); ++i) {
    if (panel.series[i].name.empty()) continue;
    const double entry = 30 + text_width(panel.series[i].name, kLabelSize);
    if (rows.empty() || used + entry > width) {
      rows.emplace_back();
      used = 0;
    }
    rows.back().push_back(i);
    used += entry;
  }
  return rows;
}

}  // namespace

PanelFrame::PanelFrame(const Panel& panel, const Eigen::Vector2d& corner, const Eigen::Vector2d& size)
    : corner_(corner), size_(size), y_down_(panel.photograph_frame), y_log_(panel.y.logarithmic) {
  const DataRange range = data_range(panel);
  x = ticks_of(panel.x, range.x, 6, !panel.x.categories.empty() || !panel.cells.empty());
  y = y_log_ ? decades_of(panel) : ticks_of(panel.y, range.y, 5, !panel.cells.empty());
  Range heat;
  for (const HeatCell& cell : panel.cells) heat.add(cell.value);
  heat_low = std::min(0.0, heat.low);
  heat_high = panel.cells_high.value_or(heat.high);
  if (!(heat_high > heat_low) || !std::isfinite(heat_high)) heat_high = heat_low + 1;

  double y_label_width = 0;
  for (const double value : y.values()) {
    y_label_width = std::max(y_label_width, text_width(y_label(value), kLabelSize));
  }
  const double left = 13 + (panel.y.title.empty() ? 0 : 16) + y_label_width;
  const double right = panel.cells.empty() ? 18 : kHeatKeyWidth;
  legend_top_ = panel.title.empty() ? 6 : 24;
  const double top = legend_top_ + 6 +
                     kLegendRow * static_cast<double>(legend_rows(panel, size.x() - left - right).size() +
                                                      (panel.arrow_key > 0 ? 1 : 0));
  const double width = size.x() - left - right;
  label_height_ = 16;
  if (!panel.x.categories.empty()) {
    const double room = width / static_cast<double>(panel.x.categories.size());
    turned_ = widest(panel.x.categories) + 6 > room;
    if (turned_) label_height_ = widest(panel.x.categories) + 10;
  }
  const double bottom = label_height_ + (panel.x.title.empty() ? 2 : 18);
  plot_corner = corner + Eigen::Vector2d(left, top);
  plot_size = {width, size.y() - top - bottom};
  if (panel.photograph_frame) {
    const double scale = std::min(plot_size.x() / (x.high - x.low), plot_size.y() / (y.high - y.low));
    plot_size = {scale * (x.high - x.low), scale * (y.high - y.low)};
  }
}

Eigen::Vector2d PanelFrame::pixel(const Eigen::Vector2d& data) const {
  const double share_x = (data.x() - x.low) / (x.high - x.low);
  const double at_y = !y_log_ ? data.y() : data.y() > 0 ? std::max(std::log10(data.y()), y.low) : y.low;
  const double share_y = (at_y - y.low) / (y.high - y.low);
  return plot_corner +
         Eigen::Vector2d(share_x * plot_size.x(), (y_down_ ? share_y : 1 - share_y) * plot_size.y());
}

std::string PanelFrame::y_label(double tick) const {
  return y_log_ ? significant_text(std::pow(10.0, tick), 1) : number_text(tick, y.step);
}

void PanelFrame::draw(const Panel& panel, Canvas& canvas) const {
  if (!panel.title.empty()) {
    canvas.text(corner_ + Eigen::Vector2d(10, 15), panel.title, {kTitleSize, Anchor::start, {}, true});
  }
  draw_legend(panel, canvas);
  for (const double value : y.values()) {
    const Eigen::Vector2d left = pixel({x.low, y_log_ ? std::pow(10.0, value) : value});
    const bool zero = !y_log_ && std::abs(value) < 1e-6 * y.step;
    if (panel.cells.empty()) {
      canvas.line(left, left + Eigen::Vector2d(plot_size.x(), 0), {{zero ? Ink::muted : Ink::grid}, 1});
    }
    canvas.text(left + Eigen::Vector2d(-6, 3.7), y_label(value), {kLabelSize, Anchor::end, kMuted});
  }
  draw_x_labels(panel, canvas);
  const Eigen::Vector2d low = plot_corner + Eigen::Vector2d(0, plot_size.y());
  canvas.line(plot_corner, low, {kMuted, 1});
  canvas.line(low, plot_corner + plot_size, {kMuted, 1});
  if (!panel.y.title.empty()) {
    canvas.text({corner_.x() + 13, plot_corner.y() + plot_size.y() / 2}, panel.y.title,
                {kLabelSize, Anchor::middle, kMuted, false, -90});
  }
  if (!panel.x.title.empty()) {
    canvas.text({plot_corner.x() + plot_size.x() / 2, low.y() + label_height_ + 14}, panel.x.title,
                {kLabelSize, Anchor::middle, kMuted});
  }
  if (!panel.cells.empty()) draw_heat_key(panel, canvas);
}

void PanelFrame::draw_legend(const Panel& panel, Canvas& canvas) const {
  double top = corner_.y() + legend_top_ + 9;
  for (const auto& row : legend_rows(panel, size_.x() - (plot_corner.x() - corner_.x()) - 10)) {
    double left = plot_corner.x();
    for (const std::size_t i : row) {
      const Series& series = panel.series[i];
      if (series.kind == Series::Kind::bars) {
        canvas.rectangle({left, top - 8}, {13, 10}, {series.ink});
      } else {
        canvas.line({left, top - 3.5}, {left + 15, top - 3.5}, {{series.ink}, 1.6, series.dashed});
        if (series.kind == Series::Kind::points) draw_marker(canvas, {left + 7.5, top - 3.5}, series.ink, 3);
      }
      canvas.text({left + 19, top}, series.name, {kLabelSize, Anchor::start, {}});
      left += 30 + text_width(series.name, kLabelSize);
    }
    top += kLegendRow;
  }
  if (panel.arrow_key > 0) {
    const double length = panel.arrow_key * panel.arrow_scale * pixels_per_unit_x();
    const Eigen::Vector2d left(plot_corner.x(), top - 3.5);
    canvas.line(left, left + Eigen::Vector2d(length, 0), {{Ink::text}, 2});
    canvas.text(left + Eigen::Vector2d(length + 6, 3.5),
                significant_text(panel.arrow_key, 1) + ' ' + panel.arrow_unit,
                {kLabelSize, Anchor::start, {}});
  }
}

void PanelFrame::draw_x_labels(const Panel& panel, Canvas& canvas) const {
  const double base = plot_corner.y() + plot_size.y();
  if (panel.x.categories.empty()) {
    for (const double value : x.values()) {
      const double left = plot_corner.x() + (value - x.low) * pixels_per_unit_x();
      canvas.line({left, base}, {left, base + 4}, {kMuted, 1});
      canvas.text({left, base + 15}, number_text(value, x.step), {kLabelSize, Anchor::middle, kMuted});
    }
    return;
  }
  // Upright labels need a text height each: leave out what does not fit.
  const double room = plot_size.x() / static_cast<double>(panel.x.categories.size());
  const auto stride =
      static_cast<std::size_t>(std::max(1.0, std::ceil((turned_ ? kLabelSize + 1 : 0) / room)));
  for (std::size_t i = 0; i < panel.x.categories.size(); i += stride) {
    const double left = plot_corner.x() + (static_cast<double>(i) - x.low) * pixels_per_unit_x();
    if (turned_) {
      canvas.text({left + 3.5, base + 6}, shortened(panel.x.categories[i]),
                  {kLabelSize, Anchor::end, kMuted, false, -90});
    } else {
      canvas.text({left, base + 15}, shortened(panel.x.categories[i]), {kLabelSize, Anchor::middle, kMuted});
    }
  }
}

void PanelFrame::draw_heat_key(const Panel& panel, Canvas& canvas) const {
  const double left = plot_corner.x() + plot_size.x() + 10;
  constexpr int kSteps = 32;
  const double step = plot_size.y() / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    // Half a pixel of overlap: no hair lines between the steps.
    canvas.rectangle({left, plot_corner.y() + step * i}, {10, step + 0.5},
                     {Ink::exact, 1, heat_rgb(1 - (i + 0.5) / kSteps)});
  }
  for (const double share : {0.0, 0.5, 1.0}) {
    canvas.text({left + 13, plot_corner.y() + plot_size.y() * (1 - share) +
                                (share == 1   ? 9
                                 : share == 0 ? 0
                                              : 4)},
                significant_text(heat_low + share * (heat_high - heat_low), 2),
                {kLabelSize, Anchor::start, kMuted});
  }
  canvas.text({left - 4, plot_corner.y() - 5}, panel.cells_title, {kLabelSize, Anchor::start, kMuted});
}

void draw_marker(Canvas& canvas, const Eigen::Vector2d& at, Ink ink, double r) {
  const auto polygon = [&](std::initializer_list<Eigen::Vector2d> corners) {
    std::vector<Eigen::Vector2d> points;
    for (const Eigen::Vector2d& corner : corners) points.push_back(at + corner);
    canvas.polygon(points, {ink});
  };
  switch ((static_cast<int>(ink) - static_cast<int>(Ink::series0)) & 3) {
    case 0:
      return canvas.circle(at, r, {ink});
    case 1:
      return canvas.rectangle(at - Eigen::Vector2d::Constant(0.9 * r), Eigen::Vector2d::Constant(1.8 * r),
                              {ink});
    case 2:
      return polygon({{0, -1.3 * r}, {1.2 * r, 0.9 * r}, {-1.2 * r, 0.9 * r}});
    default:
      return polygon({{0, -1.35 * r}, {1.35 * r, 0}, {0, 1.35 * r}, {-1.35 * r, 0}});
  }
}

}  // namespace hexcal
