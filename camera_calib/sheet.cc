#include "camera_calib/sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

#include "camera_calib/printed_marker.h"
#include "kinematics/geometry/input_error.h"
#include "photogrammetry/markers/marker.h"
#include "photogrammetry/markers/printed_pattern.h"

namespace hexcal {
namespace {

constexpr std::array kKinds{SheetKind::aprilgrid, SheetKind::chessboard, SheetKind::charuco,
                            SheetKind::dots,      SheetKind::markers,    SheetKind::photomodeler};

// On a dots sheet every fourth node of every fourth row is a marker, so that any 4 x 4 nodes hold one.
bool is_marker_node(int column, int row) { return column % 4 == 1 && row % 4 == 1; }

// PhotoModeler's sheet rings the dots next to its four corners: 4 and 3 arcs at the top, 2 and 1 at the
// bottom.
int ring_arcs(const Sheet& sheet, int column, int row) {
  const bool left = column == 1;
  const bool top = row == 1;
  if (!(left || column == sheet.columns - 2) || !(top || row == sheet.rows - 2)) return 0;
  return (top ? 3 : 1) + (left ? 1 : 0);
}

// "0-9 100-109"
std::string id_ranges(const std::vector<int>& ids) {
  std::string text;
  for (std::size_t i = 0; i < ids.size();) {
    std::size_t j = i;
    while (j + 1 < ids.size() && ids[j + 1] == ids[j] + 1) ++j;
    text += fmt::format("{}{}", text.empty() ? "" : " ", ids[i]);
    if (j > i) text += fmt::format("-{}", ids[j]);
    i = j + 1;
  }
  return text;
}

bool is_black(const Sheet& sheet, int column, int row) {
  return ((column + row) % 2 == 0) != sheet.top_left_white;
}

void require(bool good, std::string_view field, double value, std::string_view wanted) {
  if (!good) throw InputError(fmt::format("sheet: {} is {}, wanted {}", field, value, wanted));
}

void validate_ids(const Sheet& sheet) {
  const SheetGeometry geometry = sheet_geometry(sheet);
  const int known = static_cast<int>(marker_family(sheet.family).patterns.size());
  std::set<int> seen;
  for (const SheetMarker& marker : geometry.markers) {
    if (marker.id < 0 || marker.id >= known) {
      throw InputError(fmt::format("sheet: id {} is not in {}, which has ids 0 to {}", marker.id,
                                   sheet.family, known - 1));
    }
    if (same_when_turned(marker_family(sheet.family).patterns[static_cast<std::size_t>(marker.id)])) {
      throw InputError(fmt::format("sheet: id {} of {} looks the same when it is turned, wanted another id",
                                   marker.id, sheet.family));
    }
    if (!seen.insert(marker.id).second) {
      throw InputError(fmt::format("sheet: id {} stands twice, wanted each id once", marker.id));
    }
  }
}

// Top-left cell's centre when `columns` x `rows` cells at `pitch` are centred on the origin; y points up.
Eigen::Vector2d cell_centre(const Sheet& sheet, double pitch, int column, int row) {
  return {(column - 0.5 * (sheet.columns - 1)) * pitch, (0.5 * (sheet.rows - 1) - row) * pitch};
}

SheetGeometry tag_grid(const Sheet& sheet) {
  SheetGeometry geometry;
  const double pitch = printed_marker_mm(sheet) + sheet.spacing_mm;
  const std::size_t listed = sheet.ids.size();
  for (int row = 0; row < sheet.rows; ++row) {
    for (int column = 0; column < sheet.columns; ++column) {
      const auto index = static_cast<std::size_t>(row * sheet.columns + column);
      if (sheet.kind == SheetKind::markers && index >= listed) break;
      const int id =
          sheet.kind == SheetKind::markers ? sheet.ids[index] : sheet.first_id + static_cast<int>(index);
      geometry.markers.push_back({id, cell_centre(sheet, pitch, column, row), sheet.marker_mm});
    }
  }
  geometry.extent_mm = {sheet.columns * pitch - sheet.spacing_mm, sheet.rows * pitch - sheet.spacing_mm};
  return geometry;
}

SheetGeometry chessboard(const Sheet& sheet) {
  SheetGeometry geometry;
  int id = sheet.first_id;
  for (int row = 0; row < sheet.rows; ++row) {
    for (int column = 0; column < sheet.columns; ++column) {
      const Eigen::Vector2d centre = cell_centre(sheet, sheet.pitch_mm, column, row);
      if (is_black(sheet, column, row)) {
        geometry.squares.push_back({centre, sheet.pitch_mm});
      } else if (sheet.kind == SheetKind::charuco) {
        geometry.markers.push_back({id++, centre, sheet.marker_mm});
      }
      if (column > 0 && row > 0) {
        const Eigen::Vector2d corner = centre + 0.5 * sheet.pitch_mm * Eigen::Vector2d(-1, 1);
        geometry.saddles.push_back({column - 1, row - 1, corner});
      }
    }
  }
  geometry.extent_mm = sheet.pitch_mm * Eigen::Vector2d(sheet.columns, sheet.rows);
  return geometry;
}

SheetGeometry dot_grid(const Sheet& sheet) {
  SheetGeometry geometry;
  int id = sheet.first_id;
  for (int row = 0; row < sheet.rows; ++row) {
    for (int column = 0; column < sheet.columns; ++column) {
      const Eigen::Vector2d centre = cell_centre(sheet, sheet.pitch_mm, column, row);
      if (sheet.kind == SheetKind::dots && is_marker_node(column, row)) {
        geometry.markers.push_back({id++, centre, sheet.marker_mm});
      } else {
        const int arcs = sheet.kind == SheetKind::photomodeler ? ring_arcs(sheet, column, row) : 0;
        geometry.dots.push_back({column, row, centre, sheet.dot_mm, arcs});
      }
    }
  }
  const double edge = std::max(sheet.dot_mm, sheet.marker_mm);
  geometry.extent_mm =
      sheet.pitch_mm * Eigen::Vector2d(sheet.columns - 1, sheet.rows - 1) + Eigen::Vector2d::Constant(edge);
  return geometry;
}

}  // namespace

std::string_view sheet_kind_name(SheetKind kind) {
  switch (kind) {
    case SheetKind::aprilgrid:
      return "aprilgrid";
    case SheetKind::chessboard:
      return "chessboard";
    case SheetKind::charuco:
      return "charuco";
    case SheetKind::dots:
      return "dots";
    case SheetKind::markers:
      return "markers";
    case SheetKind::photomodeler:
      return "photomodeler";
  }
  return "";
}

std::optional<SheetKind> sheet_kind_from_name(std::string_view name) {
  for (const SheetKind kind : kKinds) {
    if (sheet_kind_name(kind) == name) return kind;
  }
  return std::nullopt;
}

const std::vector<std::string>& sheet_kind_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const SheetKind kind : kKinds) all.emplace_back(sheet_kind_name(kind));
    return all;
  }();
  return names;
}

void Sheet::validate() const {
  const bool chess = kind == SheetKind::chessboard || kind == SheetKind::charuco;
  const int fewest = chess ? 3 : 1;
  require(columns >= fewest && columns <= 200, "columns", columns, fmt::format("{} to 200", fewest));
  require(rows >= fewest && rows <= 200, "rows", rows, fmt::format("{} to 200", fewest));
  const bool has_markers = kind != SheetKind::chessboard && kind != SheetKind::photomodeler;
  const bool has_pitch = kind != SheetKind::aprilgrid && kind != SheetKind::markers;
  const bool has_dots = kind == SheetKind::dots || kind == SheetKind::photomodeler;
  if (has_markers) require(marker_mm > 0 && marker_mm < 1e4, "marker size in mm", marker_mm, "more than 0");
  if (!has_pitch) require(spacing_mm > 0 && spacing_mm < 1e4, "white gap in mm", spacing_mm, "more than 0");
  if (has_pitch) require(pitch_mm > 0 && pitch_mm < 1e4, "square or pitch in mm", pitch_mm, "more than 0");
  if (has_dots) {
    require(dot_mm > 0 && dot_mm < 0.8 * pitch_mm, "dot diameter in mm", dot_mm,
            "more than 0 and less than 0.8 of the pitch");
  }
  if (kind == SheetKind::charuco) {
    require(printed_marker_mm(*this) < 0.95 * pitch_mm, "marker_mm", marker_mm,
            "a marker of less than 0.95 of square_mm with all that is printed of it");
  }
  if (kind == SheetKind::dots) {
    // A marker is read only with a white border of one of its eight cells.
    require(0.625 * printed_marker_mm(*this) + 0.5 * dot_mm <= pitch_mm, "marker_mm", marker_mm,
            "a marker whose white border (1/8 of it) clears the neighbouring dots");
  }
  if (kind == SheetKind::photomodeler) {
    require(columns >= 6 && rows >= 6, "columns and rows", std::min(columns, rows), "at least 6");
  }
  if (kind == SheetKind::markers) {
    require(!ids.empty() && ids.size() <= static_cast<std::size_t>(columns * rows), "number of ids",
            static_cast<double>(ids.size()), "1 to columns x rows");
  }
  if (has_markers) validate_ids(*this);
}

double printed_marker_mm(const Sheet& sheet) {
  return sheet.family.empty() ? 0 : sheet.marker_mm * printed_share(marker_family(sheet.family));
}

SheetGeometry sheet_geometry(const Sheet& sheet) {
  switch (sheet.kind) {
    case SheetKind::aprilgrid:
    case SheetKind::markers:
      return tag_grid(sheet);
    case SheetKind::chessboard:
    case SheetKind::charuco:
      return chessboard(sheet);
    case SheetKind::dots:
    case SheetKind::photomodeler:
      return dot_grid(sheet);
  }
  return {};
}

std::vector<SheetPoint> sheet_points(const SheetGeometry& geometry) {
  std::vector<SheetPoint> points;
  const auto add = [&points](std::string name, const Eigen::Vector2d& position) {
    points.push_back({std::move(name), {position.x(), position.y(), 0.0}});
  };
  for (const SheetMarker& marker : geometry.markers) {
    for (int corner = 0; corner < 4; ++corner)
      add(fmt::format("{}.{}", marker.id, corner), marker.corner_mm(corner));
  }
  for (const SheetSaddle& saddle : geometry.saddles) {
    add(fmt::format("c{}r{}", saddle.column, saddle.row), saddle.position_mm);
  }
  for (const SheetDot& dot : geometry.dots) add(fmt::format("c{}r{}", dot.column, dot.row), dot.centre_mm);
  return points;
}

std::string describe_sheet(const Sheet& sheet) {
  const std::string grid = fmt::format("{} x {}", sheet.columns, sheet.rows);
  const SheetGeometry geometry = sheet_geometry(sheet);
  std::string ids;
  if (!geometry.markers.empty()) {
    ids = fmt::format(", ids {}-{}", geometry.markers.front().id, geometry.markers.back().id);
  }
  switch (sheet.kind) {
    case SheetKind::aprilgrid:
      return fmt::format("aprilgrid {} {}, tags {:g} mm, gap {:g} mm{}", sheet.family, grid, sheet.marker_mm,
                         sheet.spacing_mm, ids);
    case SheetKind::chessboard:
      return fmt::format("chessboard {} squares of {:g} mm", grid, sheet.pitch_mm);
    case SheetKind::charuco:
      return fmt::format("charuco {} {} squares of {:g} mm, markers {:g} mm{}", sheet.family, grid,
                         sheet.pitch_mm, sheet.marker_mm, ids);
    case SheetKind::dots:
      return fmt::format("dots {}, pitch {:g} mm, dots {:g} mm, markers {} {:g} mm{}", grid, sheet.pitch_mm,
                         sheet.dot_mm, sheet.family, sheet.marker_mm, ids);
    case SheetKind::markers:
      return fmt::format("markers {}, {:g} mm, ids {}", sheet.family, sheet.marker_mm, id_ranges(sheet.ids));
    case SheetKind::photomodeler:
      return fmt::format("photomodeler {} dots, pitch {:g} mm, dots {:g} mm", grid, sheet.pitch_mm,
                         sheet.dot_mm);
  }
  return "";
}

}  // namespace hexcal
