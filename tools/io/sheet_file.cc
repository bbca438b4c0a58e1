#include "tools/io/sheet_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <set>

#include "kinematics/geometry/input_error.h"
#include "photogrammetry/markers/marker.h"
#include "tools/io/scalar_text.h"
#include "tools/io/yaml_map.h"

namespace hexcal {
namespace {

double size_mm(const YamlMap& map, const std::string& key) {
  const double value = map.number(key);
  if (!(value > 0)) map.fail(key, fmt::format("found {}, wanted more than 0 mm", value));
  return value;
}

int positive(const YamlMap& map, const std::string& key) {
  const int value = map.integer(key);
  if (value < 1) map.fail(key, fmt::format("found {}, wanted at least 1", value));
  return value;
}

std::vector<int> read_ids(const YamlMap& map, const std::string& key) {
  std::vector<int> ids;
  for (const std::string& item : map.texts(key)) {
    const auto range = id_range_from_text(item);
    if (!range) map.fail(key, fmt::format("found '{}', wanted an id or a range such as 0-9", item));
    for (int id = range->first; id <= range->last; ++id) ids.push_back(id);
  }
  return ids;
}

void check_family(const YamlMap& map, const std::string& key, const std::string& name) {
  try {
    (void)marker_family(name);
  } catch (const InputError& error) {
    map.fail(key, error.what());
  }
}

Sheet read_sheet(const YamlMap& map) {
  Sheet sheet;
  sheet.kind = *sheet_kind_from_name(map.choice("kind", sheet_kind_names()));
  sheet.columns = positive(map, "columns");
  switch (sheet.kind) {
    case SheetKind::aprilgrid:
      sheet.family = map.text("family");
      sheet.rows = positive(map, "rows");
      sheet.marker_mm = size_mm(map, "tag_size_mm");
      sheet.spacing_mm = size_mm(map, "tag_spacing_mm");
      sheet.first_id = map.integer("first_id");
      break;
    case SheetKind::chessboard:
      sheet.rows = positive(map, "rows");
      sheet.pitch_mm = size_mm(map, "square_mm");
      break;
    case SheetKind::charuco:
      sheet.family = map.text("dictionary");
      sheet.rows = positive(map, "rows");
      sheet.pitch_mm = size_mm(map, "square_mm");
      sheet.marker_mm = size_mm(map, "marker_mm");
      sheet.first_id = map.integer("first_id");
      sheet.top_left_white = map.boolean_or("top_left_white", false);
      break;
    case SheetKind::dots:
      sheet.family = map.text("family");
      sheet.rows = positive(map, "rows");
      sheet.pitch_mm = size_mm(map, "pitch_mm");
      sheet.dot_mm = size_mm(map, "dot_mm");
      sheet.marker_mm = size_mm(map, "marker_mm");
      sheet.first_id = map.integer("first_id");
      break;
    case SheetKind::markers: {
      sheet.family = map.text("family");
      sheet.ids = read_ids(map, "ids");
      sheet.marker_mm = size_mm(map, "size_mm");
      sheet.spacing_mm = size_mm(map, "spacing_mm");
      const int count = static_cast<int>(sheet.ids.size());
      sheet.rows = std::max(1, (count + sheet.columns - 1) / sheet.columns);
      break;
    }
    case SheetKind::photomodeler:
      sheet.rows = positive(map, "rows");
      sheet.pitch_mm = size_mm(map, "pitch_mm");
      sheet.dot_mm = size_mm(map, "dot_mm");
      break;
  }
  map.finish();
  if (!sheet.family.empty()) {
    check_family(map, sheet.kind == SheetKind::charuco ? "dictionary" : "family", sheet.family);
  }
  try {
    sheet.validate();
  } catch (const InputError& error) {
    map.fail("kind", error.what());
  }
  return sheet;
}

void check_distinct(const std::vector<Sheet>& sheets, const std::filesystem::path& path) {
  std::set<std::pair<std::string, int>> seen;
  for (const Sheet& sheet : sheets) {
    for (const SheetMarker& marker : sheet_geometry(sheet).markers) {
      if (!seen.emplace(sheet.family, marker.id).second) {
        throw InputError(fmt::format("{}: id {} of {} stands on two sheets, wanted distinct ids",
                                     path.string(), marker.id, sheet.family));
      }
    }
  }
}

std::vector<std::string> lines_of(const Sheet& sheet) {
  std::vector<std::string> lines{fmt::format("kind: {}", sheet_kind_name(sheet.kind))};
  const auto add = [&lines](std::string_view key, const auto& value) {
    lines.push_back(fmt::format("{}: {}", key, value));
  };
  const bool charuco = sheet.kind == SheetKind::charuco;
  if (!sheet.family.empty()) add(charuco ? "dictionary" : "family", sheet.family);
  add("columns", sheet.columns);
  if (sheet.kind != SheetKind::markers) add("rows", sheet.rows);
  switch (sheet.kind) {
    case SheetKind::aprilgrid:
      add("tag_size_mm", sheet.marker_mm);
      add("tag_spacing_mm", sheet.spacing_mm);
      add("first_id", sheet.first_id);
      break;
    case SheetKind::chessboard:
      add("square_mm", sheet.pitch_mm);
      break;
    case SheetKind::charuco:
      add("square_mm", sheet.pitch_mm);
      add("marker_mm", sheet.marker_mm);
      add("first_id", sheet.first_id);
      if (sheet.top_left_white) add("top_left_white", true);
      break;
    case SheetKind::dots:
      add("pitch_mm", sheet.pitch_mm);
      add("dot_mm", sheet.dot_mm);
      add("marker_mm", sheet.marker_mm);
      add("first_id", sheet.first_id);
      break;
    case SheetKind::markers:
      add("ids", fmt::format("[{}]", fmt::join(sheet.ids, ", ")));
      add("size_mm", sheet.marker_mm);
      add("spacing_mm", sheet.spacing_mm);
      break;
    case SheetKind::photomodeler:
      add("pitch_mm", sheet.pitch_mm);
      add("dot_mm", sheet.dot_mm);
      break;
  }
  return lines;
}

}  // namespace

std::vector<Sheet> read_sheet_file(const std::filesystem::path& path) {
  const YamlMap map = YamlMap::read(path);
  std::vector<Sheet> sheets;
  if (map.has("sheets")) {
    for (const YamlMap& item : map.maps("sheets")) sheets.push_back(read_sheet(item));
    map.finish();
  } else {
    sheets.push_back(read_sheet(map));
  }
  if (sheets.empty()) throw InputError(fmt::format("{}: no sheets, wanted at least one", path.string()));
  check_distinct(sheets, path);
  return sheets;
}

std::string format_sheet_file(const std::string& head, const std::vector<Sheet>& sheets) {
  std::string out = head;
  if (sheets.size() == 1) {
    for (const std::string& line : lines_of(sheets.front())) out += line + '\n';
    return out;
  }
  out += "sheets:\n";
  for (const Sheet& sheet : sheets) {
    const char* indent = "  - ";
    for (const std::string& line : lines_of(sheet)) {
      out += indent + line + '\n';
      indent = "    ";
    }
  }
  return out;
}

}  // namespace hexcal
