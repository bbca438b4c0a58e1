#include "tools/io/template_drawing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "camera_calib/printed_marker.h"
#include "photogrammetry/markers/marker.h"

namespace hexcal {
namespace {

using Node = std::pair<int, int>;

// Outlines of the black cells as closed paths: one outline has no seams that a printer could leave between
// neighbouring cells.
void add_outlines(cairo_t* cr, const MarkerPattern& pattern, double left, double top, double cell) {
  const int n = pattern.cells;
  const auto black = [&pattern, n](int x, int y) {
    return x >= 0 && y >= 0 && x < n && y < n && pattern.white[static_cast<std::size_t>(y * n + x)] == 0;
  };
  std::multimap<Node, Node> edges;  // with black to the right of the way
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      if (!black(x, y)) continue;
      if (!black(x, y - 1)) edges.emplace(Node{x, y}, Node{x + 1, y});
      if (!black(x + 1, y)) edges.emplace(Node{x + 1, y}, Node{x + 1, y + 1});
      if (!black(x, y + 1)) edges.emplace(Node{x + 1, y + 1}, Node{x, y + 1});
      if (!black(x - 1, y)) edges.emplace(Node{x, y + 1}, Node{x, y});
    }
  }
  while (!edges.empty()) {
    const Node start = edges.begin()->first;
    cairo_move_to(cr, left + start.first * cell, top + start.second * cell);
    Node at = start;
    do {
      const auto edge = edges.find(at);
      at = edge->second;
      edges.erase(edge);
      if (at != start) cairo_line_to(cr, left + at.first * cell, top + at.second * cell);
    } while (at != start);
    cairo_close_path(cr);
  }
}

void draw_markers(cairo_t* cr, const Sheet& sheet, const SheetGeometry& geometry) {
  if (geometry.markers.empty()) return;
  const MarkerFamily& family = marker_family(sheet.family);
  for (const SheetMarker& marker : geometry.markers) {
    const MarkerPattern& pattern = family.patterns[static_cast<std::size_t>(marker.id)];
    const double cell = marker.size_mm / pattern.square_cells;
    const double half = 0.5 * pattern.cells * cell;
    add_outlines(cr, pattern, marker.centre_mm.x() - half, -marker.centre_mm.y() - half, cell);
  }
  cairo_set_fill_rule(cr, CAIRO_FILL_RULE_EVEN_ODD);
  cairo_fill(cr);
}

void draw_dots(cairo_t* cr, const SheetGeometry& geometry) {
  constexpr double kTurn = 2 * M_PI;
  for (const SheetDot& dot : geometry.dots) {
    const double x = dot.centre_mm.x();
    const double y = -dot.centre_mm.y();
    cairo_new_sub_path(cr);
    cairo_arc(cr, x, y, 0.5 * dot.diameter_mm, 0, kTurn);
    cairo_fill(cr);
    // Arcs share the circle with gaps of a fourth of a turn's part; one arc alone is half a ring.
    const double sweep = dot.ring_arcs == 1 ? 0.5 * kTurn : 0.5 * kTurn / std::max(dot.ring_arcs, 1);
    for (int arc = 0; arc < dot.ring_arcs; ++arc) {
      const double begin = kTurn * arc / dot.ring_arcs - 0.5 * sweep;
      cairo_new_sub_path(cr);
      cairo_arc(cr, x, y, kRingOuter * dot.diameter_mm, begin, begin + sweep);
      cairo_arc_negative(cr, x, y, kRingInner * dot.diameter_mm, begin + sweep, begin);
      cairo_close_path(cr);
      cairo_fill(cr);
    }
  }
}

// Ids stand in the middle of the white gap below the marker, clear of its white border.
void draw_ids(cairo_t* cr, const Sheet& sheet, const SheetGeometry& geometry) {
  const bool in_gap = sheet.kind == SheetKind::aprilgrid || sheet.kind == SheetKind::markers;
  if (!in_gap) return;
  const double height = std::clamp(0.2 * sheet.spacing_mm, 0.8, 2.5);
  cairo_set_source_rgb(cr, 0.6, 0.6, 0.6);
  for (const SheetMarker& marker : geometry.markers) {
    const std::string text = sheet.kind == SheetKind::markers
                                 ? fmt::format("{}  {:g} mm", marker.id, marker.size_mm)
                                 : fmt::format("{}", marker.id);
    const double y = -marker.centre_mm.y() + 0.5 * (printed_marker_mm(sheet) + sheet.spacing_mm);
    const bool marker_sheet = sheet.kind == SheetKind::markers;
    draw_text(cr, marker.centre_mm.x() - 0.5 * printed_marker_mm(sheet),
              marker_sheet ? y - 0.3 : y + 0.35 * height, height, text);
  }
  cairo_set_source_rgb(cr, 0, 0, 0);
}

void draw_cut_lines(cairo_t* cr, const Sheet& sheet, const SheetGeometry& geometry) {
  if (sheet.kind != SheetKind::markers) return;
  cairo_set_source_rgb(cr, 0.6, 0.6, 0.6);
  cairo_set_line_width(cr, 0.1);
  const double edge = printed_marker_mm(sheet) + sheet.spacing_mm;
  for (const SheetMarker& marker : geometry.markers) {
    cairo_rectangle(cr, marker.centre_mm.x() - 0.5 * edge, -marker.centre_mm.y() - 0.5 * edge, edge, edge);
    cairo_stroke(cr);
  }
  cairo_set_source_rgb(cr, 0, 0, 0);
}

}  // namespace

void draw_text(cairo_t* cr, double x_mm, double y_mm, double height_mm, const std::string& text) {
  cairo_select_font_face(cr, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(cr, height_mm);
  cairo_move_to(cr, x_mm, y_mm);
  cairo_show_text(cr, text.c_str());
  cairo_new_path(cr);
}

void draw_check_ruler(cairo_t* cr, double x_mm, double y_mm, bool vertical) {
  cairo_save(cr);
  cairo_translate(cr, x_mm, y_mm);
  cairo_set_line_width(cr, 0.15);
  cairo_set_line_cap(cr, CAIRO_LINE_CAP_BUTT);
  const auto line = [cr, vertical](double a0, double b0, double a1, double b1) {
    cairo_move_to(cr, vertical ? b0 : a0, vertical ? a0 : b0);
    cairo_line_to(cr, vertical ? b1 : a1, vertical ? a1 : b1);
    cairo_stroke(cr);
  };
  line(-0.075, 0, 100.075, 0);
  for (int tick = 0; tick <= 10; ++tick) line(10.0 * tick, 0, 10.0 * tick, tick % 5 == 0 ? 3 : 1.5);
  if (vertical) {
    cairo_translate(cr, 5.5, 42);
    cairo_rotate(cr, 0.5 * M_PI);
    draw_text(cr, 0, 0, 2.5, "100 mm");
  } else {
    draw_text(cr, 42, 5.5, 2.5, "100 mm");
  }
  cairo_restore(cr);
}

void draw_sheet(cairo_t* cr, const Sheet& sheet) {
  const SheetGeometry geometry = sheet_geometry(sheet);
  cairo_set_source_rgb(cr, 0, 0, 0);
  for (const SheetSquare& square : geometry.squares) {
    cairo_rectangle(cr, square.centre_mm.x() - 0.5 * square.size_mm,
                    -square.centre_mm.y() - 0.5 * square.size_mm, square.size_mm, square.size_mm);
  }
  cairo_fill(cr);
  draw_markers(cr, sheet, geometry);
  draw_dots(cr, geometry);
  draw_ids(cr, sheet, geometry);
  draw_cut_lines(cr, sheet, geometry);
}

}  // namespace hexcal
