#pragma once

#include <string>
#include <vector>

#include "tools/report/axis_ticks.h"
#include "tools/report/chart.h"

namespace hexcal {

/// Where a panel's plot lies on the canvas and how data become pixels.
class PanelFrame {
 public:
  PanelFrame(const Panel& panel, const Eigen::Vector2d& corner, const Eigen::Vector2d& size);

  [[nodiscard]] Eigen::Vector2d pixel(const Eigen::Vector2d& data) const;
  /// Label of a tick of y.
  [[nodiscard]] std::string y_label(double tick) const;
  [[nodiscard]] double pixels_per_unit_x() const { return plot_size.x() / (x.high - x.low); }

  /// Title, legend, grid, ticks and labels, colour key.
  void draw(const Panel& panel, Canvas& canvas) const;

  AxisTicks x, y;
  Eigen::Vector2d plot_corner, plot_size;
  double heat_low = 0, heat_high = 1;

 private:
  void draw_legend(const Panel& panel, Canvas& canvas) const;
  void draw_x_labels(const Panel& panel, Canvas& canvas) const;
  void draw_heat_key(const Panel& panel, Canvas& canvas) const;

  Eigen::Vector2d corner_, size_;
  double legend_top_ = 0;
  double label_height_ = 0;  ///< of the x labels
  bool turned_ = false;      ///< x labels stand upright
  bool y_down_ = false;
  bool y_log_ = false;  ///< y holds decades
};

/// Mark of a series in points and legends: each series has its own shape beside its own colour.
void draw_marker(Canvas& canvas, const Eigen::Vector2d& at, Ink ink, double radius);

}  // namespace hexcal
