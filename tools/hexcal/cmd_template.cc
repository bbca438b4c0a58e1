#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "kinematics/geometry/input_error.h"
#include "photogrammetry/markers/marker.h"
#include "tools/hexcal/command.h"
#include "tools/hexcal/terminal.h"
#include "tools/io/atomic_file.h"
#include "tools/io/scalar_text.h"
#include "tools/io/sheet_file.h"
#include "tools/io/template_pdf.h"
#include "tools/io/version.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

struct TemplateFlags {
  std::string kind;
  fs::path output;
  std::string family;
  std::string ids;
  std::string paper = "A4";
  bool landscape = false;
  int columns = 0, rows = 0, sheets = 1;
  int first_id = 0;
  double marker_mm = 0, gap_mm = 0, square_mm = 0, pitch_mm = 0, dot_mm = 0;
};

constexpr const char* kTemplateFooter =
    R"(  hexcal template aprilgrid --marker-mm 20 --gap-mm 7 --paper A3 --landscape -o sheet.pdf
  hexcal template chessboard --square-mm 20 --columns 12 --rows 8 -o board.pdf
  hexcal template charuco --square-mm 22 --marker-mm 16 -o charuco.pdf
  hexcal template dots --pitch-mm 15 --dot-mm 6 --marker-mm 13 -o dots.pdf
  hexcal template markers --ids 0-9,100-109 --marker-mm 24 --gap-mm 8 -o markers.pdf
  hexcal template photomodeler --pitch-mm 18 --dot-mm 4 -o pm.pdf

Without --columns and --rows the page is filled. Print at 100 %, measure both rulers, keep the sheet flat.

  aprilgrid tag36h11 14 x 9, tags 20 mm, gap 7 mm, ids 0-125
  wrote sheet.pdf (1 page) and sheet.yaml (for hexcal camera --template))";

std::vector<int> parse_ids(const std::string& text) {
  std::vector<int> ids;
  for (std::string_view rest = text; !rest.empty();) {
    const std::size_t comma = std::min(rest.find(','), rest.size());
    const auto range = id_range_from_text(rest.substr(0, comma));
    rest.remove_prefix(std::min(comma + 1, rest.size()));
    if (!range) {
      throw InputError(fmt::format("--ids: found '{}', wanted ids and ranges such as 0-9,100-109", text));
    }
    for (int id = range->first; id <= range->last; ++id) ids.push_back(id);
  }
  return ids;
}

double wanted(double value, const char* flag) {
  if (!(value > 0))
    throw InputError(fmt::format("{} is missing, wanted a size in mm: sizes have no default", flag));
  return value;
}

Sheet sheet_from(const TemplateFlags& flags) {
  Sheet sheet;
  sheet.kind = *sheet_kind_from_name(flags.kind);
  sheet.first_id = flags.first_id;
  const bool charuco = sheet.kind == SheetKind::charuco;
  if (sheet.kind != SheetKind::chessboard && sheet.kind != SheetKind::photomodeler) {
    sheet.marker_mm = wanted(flags.marker_mm, "--marker-mm");
    sheet.family = !flags.family.empty() ? flags.family : charuco ? "DICT_5X5_250" : "tag36h11";
  }
  switch (sheet.kind) {
    case SheetKind::aprilgrid:
    case SheetKind::markers:
      sheet.spacing_mm = wanted(flags.gap_mm, "--gap-mm");
      break;
    case SheetKind::chessboard:
    case SheetKind::charuco:
      sheet.pitch_mm = wanted(flags.square_mm, "--square-mm");
      break;
    case SheetKind::dots:
    case SheetKind::photomodeler:
      sheet.pitch_mm = wanted(flags.pitch_mm, "--pitch-mm");
      sheet.dot_mm = wanted(flags.dot_mm, "--dot-mm");
      break;
  }
  if (sheet.kind == SheetKind::markers) {
    sheet.ids = parse_ids(flags.ids);
    if (sheet.ids.empty()) throw InputError("--ids is missing, wanted ids and ranges such as 0-9,100-109");
  }
  return sheet;
}

void set_grid(Sheet& sheet, const TemplateFlags& flags, const TemplatePdfOptions& options) {
  const auto [columns, rows] = largest_grid(sheet, options);
  const bool photomodeler = sheet.kind == SheetKind::photomodeler;
  sheet.columns = flags.columns > 0 ? flags.columns : photomodeler ? 10 : columns;
  if (sheet.kind == SheetKind::markers) {
    const int count = static_cast<int>(sheet.ids.size());
    sheet.columns = std::min(std::max(sheet.columns, 1), count);
    sheet.rows = (count + sheet.columns - 1) / sheet.columns;
  } else {
    sheet.rows = flags.rows > 0 ? flags.rows : photomodeler ? 10 : rows;
  }
  sheet.validate();
}

int run_template(const TemplateFlags& flags) {
  TemplatePdfOptions options;
  const auto paper = paper_size(flags.paper);
  if (!paper) {
    throw InputError(
        fmt::format("--paper: found '{}', wanted A4, A3, letter, legal or WIDTHxHEIGHT in mm", flags.paper));
  }
  options.paper_mm = *paper;
  if (flags.landscape) std::swap(options.paper_mm.width_mm, options.paper_mm.height_mm);
  options.validate();
  Sheet sheet = sheet_from(flags);
  set_grid(sheet, flags, options);
  std::vector<Sheet> sheets;
  if (sheet.kind == SheetKind::markers) sheets = sticker_pages(sheet, options);
  for (int i = 0; i < flags.sheets && sheet.kind != SheetKind::markers; ++i) {
    sheets.push_back(sheet);
    sheet.first_id += static_cast<int>(sheet_geometry(sheet).markers.size());
    if (i + 1 < flags.sheets) sheet.validate();
  }
  if (flags.sheets > 1 && (sheet.family.empty() || sheet.kind == SheetKind::markers)) {
    throw InputError(fmt::format("--sheets: {} sheets cannot be told apart by ids", flags.kind));
  }
  const fs::path yaml = fs::path(flags.output).replace_extension(".yaml");
  if (yaml == flags.output) throw InputError("-o: wanted a name that ends with .pdf");
  write_files_atomically({{flags.output, template_pdf(sheets, options)},
                          {yaml, format_sheet_file(provenance_line(kVersion, "template", {}), sheets)}});
  int pages = 0;
  for (const Sheet& each : sheets) {
    fmt::print("{}\n", describe_sheet(each));
    const TemplateTiles tiles = template_tiles(each, options);
    pages += tiles.columns * tiles.rows;
  }
  fmt::print("wrote {} ({} page{}) and {} (for hexcal camera --template)\n", flags.output.string(), pages,
             pages == 1 ? "" : "s", yaml.string());
  if (sheet.kind != SheetKind::markers) {
    suggest_next(
        fmt::format("hexcal camera PHOTOGRAPHS --template {} -o camera.yaml", shell_word(yaml.string())));
  }
  return kDone;
}

}  // namespace

void add_template_command(CLI::App& app, Action& action) {
  auto flags = std::make_shared<TemplateFlags>();
  CLI::App* command =
      app.add_subcommand("template", "Draw a calibration sheet or markers as a vector PDF, true to scale.");
  command->footer(kTemplateFooter);
  command->add_option("KIND", flags->kind, fmt::format("one of {}", fmt::join(sheet_kind_names(), ", ")))
      ->required()
      ->check(CLI::IsMember(sheet_kind_names()));
  command->add_option("-o,--output", flags->output, "PDF to write; sheet.yaml is written beside it")
      ->required();
  command->add_option("--family,--dictionary", flags->family,
                      "marker family (tag36h11; charuco DICT_5X5_250)");
  command->add_option("--columns", flags->columns, "tags, squares or dots per row")
      ->check(CLI::Range(1, 200));
  command->add_option("--rows", flags->rows, "rows of them")->check(CLI::Range(1, 200));
  command->add_option("--marker-mm,--tag-mm", flags->marker_mm, "edge of a marker's black square, mm");
  command->add_option("--gap-mm", flags->gap_mm, "white gap between markers, mm");
  command->add_option("--square-mm", flags->square_mm, "edge of a chessboard square, mm");
  command->add_option("--pitch-mm", flags->pitch_mm, "dot to dot, mm");
  command->add_option("--dot-mm", flags->dot_mm, "diameter of a dot, mm");
  command->add_option("--first-id", flags->first_id, "id at the printed top left")
      ->check(CLI::Range(0, 100000));
  command->add_option("--ids", flags->ids, "markers to print, such as 0-9,100-109");
  command->add_option("--sheets", flags->sheets, "sheets with distinct ids in one set")
      ->check(CLI::Range(1, 100));
  command->add_option("--paper", flags->paper, "A4, A3, letter, legal or WIDTHxHEIGHT in mm");
  command->add_flag("--landscape", flags->landscape, "turn the paper");
  command->callback([flags, &action] { action = [flags] { return run_template(*flags); }; });
}

}  // namespace hexcal
