#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "camera_calib/sheet.h"

namespace hexcal {

struct PaperSize {
  double width_mm = 0;
  double height_mm = 0;
};

/// A4, A3, letter, legal (any case), or WIDTHxHEIGHT in mm; none if it is neither.
[[nodiscard]] std::optional<PaperSize> paper_size(std::string_view name);

struct TemplatePdfOptions {
  PaperSize paper_mm{210, 297};
  double margin_mm = 8;         ///< what the printer cannot reach
  double tile_overlap_mm = 10;  ///< of neighbouring pages of a sheet larger than the paper

  /// Throws InputError naming field and value.
  void validate() const;
};

/// White paper that must stay free around the pattern, and the strips for rulers and text.
struct TemplateCanvas {
  double width_mm = 0;
  double height_mm = 0;
  Eigen::Vector2d pattern_centre_mm;  ///< from the canvas's top left, y down
};
[[nodiscard]] TemplateCanvas template_canvas(const Sheet& sheet);

/// Pages needed for one sheet: columns and rows of tiles.
struct TemplateTiles {
  int columns = 1;
  int rows = 1;
};
[[nodiscard]] TemplateTiles template_tiles(const Sheet& sheet, const TemplatePdfOptions& options);

/// Largest grid of columns x rows, others as in `sheet`, that stays on one page; zero if none does.
[[nodiscard]] std::pair<int, int> largest_grid(Sheet sheet, const TemplatePdfOptions& options);

/// Markers to be cut out (kind markers) on as many sheets as they need for each to stay whole on one page,
/// `columns` beside one another. Throws InputError if not even one row fits.
[[nodiscard]] std::vector<Sheet> sticker_pages(const Sheet& sheet, const TemplatePdfOptions& options);

/// A vector PDF true to scale: the pattern, ids in small grey print, two 100 mm check rulers, a text line
/// with kind and sizes, cut lines around markers, crosses where tiled pages meet. Same sheets, same bytes.
[[nodiscard]] std::string template_pdf(const std::vector<Sheet>& sheets, const TemplatePdfOptions& options);

}  // namespace hexcal
