#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "tools/report/canvas.h"

namespace hexcal {

/// One series of a panel. Bars of several series stand side by side in each category; points and lines take
/// `x`, or 0, 1, 2, ... (the categories) if it is empty. NaN in `y` leaves a gap.
struct Series {
  enum class Kind { bars, points, line };
  std::string name;  ///< legend entry; empty: none
  Kind kind = Kind::points;
  Ink ink = Ink::series0;
  std::vector<double> x;
  std::vector<double> y;
  std::vector<double> sigma;      ///< empty, or one standard deviation each: a bar, or a band for lines
  std::vector<std::string> tips;  ///< empty, or one each; default: name, category and value
  bool dashed = false;
};

/// An arrow from a place in the panel, `by` in data units before the panel's arrow_scale.
struct Arrow {
  Eigen::Vector2d from, by;
  Ink ink = Ink::series0;
  std::string tip;
};

/// A rectangle of a heat map; NaN: no data.
struct HeatCell {
  Eigen::Vector2d low, high;
  double value = 0;
  std::string tip;
};

struct Axis {
  std::string title;                    ///< with its unit: "error (mm)"
  std::vector<std::string> categories;  ///< empty: numbers
  std::optional<double> low, high;      ///< default: what the data need
  bool logarithmic = false;             ///< of a y axis with values above zero
};

/// One pair of axes with what is drawn in it.
struct Panel {
  std::string title;
  Axis x, y;
  std::vector<Series> series;
  std::vector<HeatCell> cells;
  std::string cells_title;           ///< of the heat map's colour key, with unit
  std::optional<double> cells_high;  ///< top of the colour key; default: the largest value
  std::vector<Arrow> arrows;
  double arrow_scale = 1;         ///< arrows are drawn this many times longer than `by`
  double arrow_key = 0;           ///< length in data units of the arrow in the key; 0: no key
  std::string arrow_unit;         ///< "px"
  bool photograph_frame = false;  ///< y down and both axes to the same scale
  bool value_labels = false;      ///< bars carry their value where there is room
};

/// A picture of a report: panels row by row.
struct Chart {
  std::string id;       ///< file name without extension: "figure_11_option1_ranges"
  std::string title;    ///< read by screen readers and shown above
  std::string caption;  ///< what is seen and what to look for
  std::vector<Panel> panels;
  int columns = 2;
  Eigen::Vector2d panel_size{440, 270};
};

/// Size of the whole drawing in pixels.
[[nodiscard]] Eigen::Vector2d chart_size(const Chart& chart);
void draw_chart(const Chart& chart, Canvas& canvas);

/// The chart as an element of a page, as an SVG file, as the bytes of a PDF file.
[[nodiscard]] std::string chart_inline_svg(const Chart& chart);
[[nodiscard]] std::string chart_svg_file(const Chart& chart);
[[nodiscard]] std::string chart_pdf_file(const Chart& chart);

/// Colour of a share in [0, 1] of a heat map's range: cividis-like, dark blue to yellow, monotonic in
/// lightness and readable with any colour vision (after Nunez, Anderton, Renslow, 2018).
[[nodiscard]] std::uint32_t heat_rgb(double share);

}  // namespace hexcal
