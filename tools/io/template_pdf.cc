#include "tools/io/template_pdf.h"

#include <cairo-pdf.h>
#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <memory>

#include "kinematics/geometry/input_error.h"
#include "photogrammetry/markers/marker.h"
#include "tools/io/scalar_text.h"
#include "tools/io/template_drawing.h"

namespace hexcal {
namespace {

constexpr double kPointsPerMm = 72.0 / 25.4;
constexpr double kStripMm = 9;  // of a ruler with its label
constexpr double kTextMm = 4;   // of the text line

// White paper that detectors want around the pattern: a cell of a marker, half a square, a dot.
double quiet_zone(const Sheet& sheet) {
  switch (sheet.kind) {
    case SheetKind::aprilgrid:
      return std::max(0.5 * sheet.spacing_mm, sheet.marker_mm / 6);
    case SheetKind::markers:
      return 0.5 * sheet.spacing_mm;
    case SheetKind::chessboard:
    case SheetKind::charuco:
      return 0.5 * sheet.pitch_mm;
    case SheetKind::dots:
      return std::max(sheet.dot_mm, 0.2 * sheet.marker_mm);
    case SheetKind::photomodeler:
      return sheet.dot_mm;
  }
  return 0;
}

int tiles_along(double canvas_mm, double page_mm, double overlap_mm) {
  if (canvas_mm <= page_mm) return 1;
  return static_cast<int>(std::ceil((canvas_mm - overlap_mm) / (page_mm - overlap_mm) - 1e-9));
}

double page_width(const TemplatePdfOptions& o) { return o.paper_mm.width_mm - 2 * o.margin_mm; }
double page_height(const TemplatePdfOptions& o) { return o.paper_mm.height_mm - 2 * o.margin_mm; }

void draw_canvas(cairo_t* cr, const Sheet& sheet, const std::string& text) {
  const TemplateCanvas canvas = template_canvas(sheet);
  cairo_save(cr);
  cairo_translate(cr, canvas.pattern_centre_mm.x(), canvas.pattern_centre_mm.y());
  draw_sheet(cr, sheet);
  cairo_restore(cr);
  cairo_set_source_rgb(cr, 0, 0, 0);
  const double below = canvas.height_mm - kStripMm - kTextMm;
  draw_check_ruler(cr, 2, below + 1, false);
  draw_check_ruler(cr, canvas.width_mm - kStripMm + 2, std::max(2.0, 0.5 * (below - 100)), true);
  draw_text(cr, 2, canvas.height_mm - 1, 2.5, text);
}

// Crosses at the corners of the part that this page shares with its neighbours.
void draw_tile_marks(cairo_t* cr, double width, double height, double overlap) {
  cairo_set_source_rgb(cr, 0.6, 0.6, 0.6);
  cairo_set_line_width(cr, 0.1);
  for (const double x : {0.5 * overlap, width - 0.5 * overlap}) {
    for (const double y : {0.5 * overlap, height - 0.5 * overlap}) {
      cairo_move_to(cr, x - 3, y);
      cairo_line_to(cr, x + 3, y);
      cairo_move_to(cr, x, y - 3);
      cairo_line_to(cr, x, y + 3);
      cairo_stroke(cr);
    }
  }
}

void draw_pages(cairo_t* cr, const Sheet& sheet, const std::string& title,
                const TemplatePdfOptions& options) {
  const TemplateCanvas canvas = template_canvas(sheet);
  const TemplateTiles tiles = template_tiles(sheet, options);
  const double width = page_width(options);
  const double height = page_height(options);
  for (int row = 0; row < tiles.rows; ++row) {
    for (int column = 0; column < tiles.columns; ++column) {
      // One page: the canvas is centred; tiles: it is cut.
      const double left =
          tiles.columns == 1 ? 0.5 * (width - canvas.width_mm) : -column * (width - options.tile_overlap_mm);
      const double top =
          tiles.rows == 1 ? 0.5 * (height - canvas.height_mm) : -row * (height - options.tile_overlap_mm);
      cairo_save(cr);
      cairo_scale(cr, kPointsPerMm, kPointsPerMm);
      cairo_translate(cr, options.margin_mm, options.margin_mm);
      cairo_rectangle(cr, 0, 0, width, height);
      cairo_clip(cr);
      cairo_save(cr);
      cairo_translate(cr, left, top);
      draw_canvas(cr, sheet, title);
      cairo_restore(cr);
      if (tiles.columns * tiles.rows > 1) {
        draw_tile_marks(cr, width, height, options.tile_overlap_mm);
        draw_text(cr, 0.5 * options.tile_overlap_mm + 4, 0.5 * options.tile_overlap_mm - 1, 2,
                  fmt::format("page row {} of {}, column {} of {}: lay the crosses over one another", row + 1,
                              tiles.rows, column + 1, tiles.columns));
      }
      cairo_restore(cr);
      cairo_show_page(cr);
    }
  }
}

cairo_status_t append(void* closure, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(closure)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace

std::optional<PaperSize> paper_size(std::string_view name) {
  std::string lower(name);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (lower == "a4") return PaperSize{210, 297};
  if (lower == "a3") return PaperSize{297, 420};
  if (lower == "letter") return PaperSize{215.9, 279.4};
  if (lower == "legal") return PaperSize{215.9, 355.6};
  const std::size_t cross = lower.find('x');
  if (cross == std::string::npos) return std::nullopt;
  const auto width = number_from_text(std::string_view(lower).substr(0, cross));
  const auto height = number_from_text(std::string_view(lower).substr(cross + 1));
  if (!width || !height || !(*width > 0) || !(*height > 0)) return std::nullopt;
  return PaperSize{*width, *height};
}

void TemplatePdfOptions::validate() const {
  const auto require = [](bool good, const char* field, double value, const char* wanted) {
    if (!good) throw InputError(fmt::format("template: {} is {:g}, wanted {}", field, value, wanted));
  };
  require(margin_mm >= 0, "margin_mm", margin_mm, "at least 0");
  const double smallest = std::min(paper_mm.width_mm, paper_mm.height_mm);
  require(smallest - 2 * margin_mm >= 120, "paper size in mm", smallest,
          "at least 120 mm between the margins for the check rulers");
  require(std::max(paper_mm.width_mm, paper_mm.height_mm) <= 5000, "paper size in mm",
          std::max(paper_mm.width_mm, paper_mm.height_mm), "at most 5000");
  require(tile_overlap_mm >= 0 && tile_overlap_mm < 50, "tile_overlap_mm", tile_overlap_mm, "0 to 50");
}

TemplateCanvas template_canvas(const Sheet& sheet) {
  const SheetGeometry geometry = sheet_geometry(sheet);
  const double quiet = quiet_zone(sheet);
  const Eigen::Vector2d pattern = geometry.extent_mm.array() + 2 * quiet;
  TemplateCanvas canvas;
  // The rulers need 104 mm even beside a small pattern.
  canvas.width_mm = std::max(pattern.x(), 104.0) + kStripMm;
  canvas.height_mm = std::max(pattern.y(), 104.0) + kStripMm + kTextMm;
  canvas.pattern_centre_mm = {0.5 * (canvas.width_mm - kStripMm),
                              0.5 * (canvas.height_mm - kStripMm - kTextMm)};
  return canvas;
}

TemplateTiles template_tiles(const Sheet& sheet, const TemplatePdfOptions& options) {
  const TemplateCanvas canvas = template_canvas(sheet);
  return {tiles_along(canvas.width_mm, page_width(options), options.tile_overlap_mm),
          tiles_along(canvas.height_mm, page_height(options), options.tile_overlap_mm)};
}

std::pair<int, int> largest_grid(Sheet sheet, const TemplatePdfOptions& options) {
  const auto fits = [&sheet, &options](int columns, int rows) {
    sheet.columns = columns;
    sheet.rows = rows;
    const TemplateCanvas canvas = template_canvas(sheet);
    return canvas.width_mm <= page_width(options) && canvas.height_mm <= page_height(options);
  };
  int columns = 0;
  int rows = 0;
  while (columns < 200 && fits(columns + 1, 1)) ++columns;
  while (rows < 200 && fits(1, rows + 1)) ++rows;
  return {columns, rows};
}

std::vector<Sheet> sticker_pages(const Sheet& sheet, const TemplatePdfOptions& options) {
  const auto [columns, rows] = largest_grid(sheet, options);
  if (rows < 1 || columns < sheet.columns) {
    throw InputError(
        fmt::format("template: {} marker{} of {:g} mm beside one another do not fit on the page, "
                    "wanted whole stickers: larger paper or fewer columns",
                    sheet.columns, sheet.columns == 1 ? "" : "s", sheet.marker_mm));
  }
  const auto per_page = static_cast<std::size_t>(sheet.columns * rows);
  std::vector<Sheet> pages;
  for (std::size_t first = 0; first < sheet.ids.size(); first += per_page) {
    const std::size_t last = std::min(first + per_page, sheet.ids.size());
    Sheet page = sheet;
    page.ids.assign(sheet.ids.begin() + static_cast<std::ptrdiff_t>(first),
                    sheet.ids.begin() + static_cast<std::ptrdiff_t>(last));
    page.rows = (static_cast<int>(page.ids.size()) + sheet.columns - 1) / sheet.columns;
    pages.push_back(page);
  }
  return pages;
}

std::string template_pdf(const std::vector<Sheet>& sheets, const TemplatePdfOptions& options) {
  options.validate();
  std::string out;
  using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
  using Context = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;
  const Surface surface(
      cairo_pdf_surface_create_for_stream(append, &out, options.paper_mm.width_mm * kPointsPerMm,
                                          options.paper_mm.height_mm * kPointsPerMm),
      cairo_surface_destroy);
  // A fixed date: the same sheet gives the same bytes.
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATE_DATE, "2000-01-01T00:00:00Z");
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_TITLE,
                                 describe_sheet(sheets.front()).c_str());
  {
    const Context cr(cairo_create(surface.get()), cairo_destroy);
    for (std::size_t i = 0; i < sheets.size(); ++i) {
      const std::string number =
          sheets.size() > 1 ? fmt::format("sheet {} of {}: ", i + 1, sheets.size()) : std::string();
      draw_pages(cr.get(), sheets[i],
                 fmt::format("{}{}. Print at 100 %; both rulers must measure 100 mm.", number,
                             describe_sheet(sheets[i])),
                 options);
    }
  }
  cairo_surface_finish(surface.get());
  if (cairo_surface_status(surface.get()) != CAIRO_STATUS_SUCCESS) {
    throw std::runtime_error(cairo_status_to_string(cairo_surface_status(surface.get())));
  }
  return out;
}

}  // namespace hexcal
