#include "tools/io/csv_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/printable_text.h"
#include "tools/io/atomic_file.h"
#include "tools/io/csv_dialect.h"
#include "tools/io/number_range.h"
#include "tools/io/scalar_text.h"

namespace hexcal {
namespace {

// Far beyond any table of ours; a file without commas or line breaks is something else.
constexpr std::size_t kMaxColumns = 1000;
constexpr std::size_t kMaxFieldBytes = std::size_t{1} << 20;
constexpr std::string_view kBlank = " \t";

// Takes one record off `text`, which may span lines inside quotes; counts the lines it took. Stops early at
// a field or a number of fields that no table has.
std::vector<std::string> take_record(std::string_view& text, char separator, int& lines, std::string& fault) {
  std::vector<std::string> fields;
  std::string field;
  bool quoted = false;
  bool was_quoted = false;
  std::size_t i = 0;
  lines = 1;
  const auto finish_field = [&] {
    fields.push_back(printable_text(was_quoted ? std::string_view(field) : trimmed(field)));
    field.clear();
    was_quoted = false;
  };
  for (; i < text.size() && field.size() <= kMaxFieldBytes && fields.size() < kMaxColumns; ++i) {
    const char c = text[i];
    if (quoted) {
      if (c == '"' && i + 1 < text.size() && text[i + 1] == '"') {
        field += '"';
        ++i;
      } else if (c == '"') {
        quoted = false;
      } else {
        if (c == '\n') ++lines;
        field += c;
      }
    } else if (c == '"' && trimmed(field).empty()) {
      field.clear();
      quoted = was_quoted = true;
    } else if (c == separator) {
      finish_field();
    } else if (c == '\n') {
      break;
    } else if (c != '\r') {
      if (was_quoted && kBlank.find(c) == std::string_view::npos) fault = "text behind a quoted field";
      if (!was_quoted) field += c;
    }
  }
  if (quoted && i >= text.size()) fault = "a quote is not closed";
  finish_field();
  text.remove_prefix(std::min(i + 1, text.size()));
  return fields;
}

// Spreadsheets fill up lines that are shorter than others with empty fields.
void drop_empty_end(std::vector<std::string>& fields, std::size_t wanted) {
  while (fields.size() > wanted && fields.back().empty()) fields.pop_back();
}

}  // namespace

CsvTable CsvTable::parse(std::string_view bytes, const std::filesystem::path& path) {
  CsvTable table;
  table.path_ = path;
  const std::string utf8 = csv_as_utf8(std::string(bytes));
  std::string_view text = utf8;
  int line = 1;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    const std::string_view first_line = text.substr(0, end);
    const std::string_view head = trimmed(first_line);
    // A comment with commas is quoted by a spreadsheet.
    const bool comment = head.starts_with('#') || (table.columns_.empty() && head.starts_with("\"#"));
    if (head.empty() || comment) {
      if (!head.empty()) table.comments_.emplace_back(head);
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
      ++line;
      continue;
    }
    if (table.columns_.empty()) table.separator_ = csv_separator(first_line);
    int lines = 1;
    std::string fault;
    Row row{line, take_record(text, table.separator_, lines, fault)};
    if (row.fields.size() > kMaxColumns || row.fields.back().size() > kMaxFieldBytes) {
      throw InputError(
          fmt::format("{}:{}: no CSV table: more than {} fields in a line, or one of more than {} bytes",
                      path.string(), line, kMaxColumns, kMaxFieldBytes));
    }
    if (!fault.empty()) throw InputError(fmt::format("{}:{}: {}", path.string(), line, fault));
    line += lines;
    drop_empty_end(row.fields, table.columns_.empty() ? 1 : table.columns_.size());
    const bool blank =
        std::all_of(row.fields.begin(), row.fields.end(), [](const auto& f) { return f.empty(); });
    if (blank && table.separator_ != ',') continue;
    if (table.columns_.empty()) {
      table.columns_ = std::move(row.fields);
      for (std::size_t i = 0; i < table.columns_.size(); ++i) {
        if (std::count(table.columns_.begin(), table.columns_.end(), table.columns_[i]) > 1) {
          throw InputError(
              fmt::format("{}:{}: column '{}' stands twice", path.string(), row.line, table.columns_[i]));
        }
      }
    } else if (row.fields.size() != table.columns_.size()) {
      throw InputError(fmt::format("{}:{}: found {} fields, wanted {} as in the header", path.string(),
                                   row.line, row.fields.size(), table.columns_.size()));
    } else {
      table.rows_.push_back(std::move(row));
    }
  }
  if (table.columns_.empty()) throw InputError(fmt::format("{}: no header line", path.string()));
  return table;
}

CsvTable CsvTable::read(const std::filesystem::path& path, ReadFor purpose) {
  return parse(read_file(path, purpose), path);
}

bool CsvTable::has_column(std::string_view name) const {
  return std::find(columns_.begin(), columns_.end(), name) != columns_.end();
}

void CsvTable::require_columns(const std::vector<std::string>& names) const {
  for (const auto& name : names) {
    if (!has_column(name)) {
      throw InputError(fmt::format("{}: column '{}' is missing; found {}", path_.string(), name,
                                   fmt::join(columns_, ", ")));
    }
  }
}

std::size_t CsvTable::column_index(std::string_view name) const {
  const auto found = std::find(columns_.begin(), columns_.end(), name);
  if (found == columns_.end()) require_columns({std::string(name)});
  return static_cast<std::size_t>(found - columns_.begin());
}

const std::string& CsvTable::text(std::size_t row, std::string_view column) const {
  return rows_[row].fields[column_index(column)];
}

void CsvTable::fail(std::size_t row, std::string_view column, const std::string& message) const {
  throw InputError(fmt::format("{}:{}: column '{}': {}", path_.string(), rows_[row].line, column, message));
}

double CsvTable::number(std::size_t row, std::string_view column) const {
  const std::string& field = text(row, column);
  const auto value = csv_number(field, separator_);
  if (!value) fail(row, column, fmt::format("'{}' is not a number", field));
  std::string fault;
  const double number = ranged_number(column, *value, fault);
  if (!fault.empty()) fail(row, column, fault);
  return number;
}

std::optional<double> CsvTable::optional_number(std::size_t row, std::string_view column) const {
  const std::string& field = text(row, column);
  if (field.empty() || field == "nan" || field == "NaN") return std::nullopt;
  return number(row, column);
}

int CsvTable::integer(std::size_t row, std::string_view column) const {
  const double value = number(row, column);
  if (value != std::floor(value) || std::abs(value) > 2e9) {
    fail(row, column, fmt::format("'{}' is not a whole number", text(row, column)));
  }
  return static_cast<int>(value);
}

std::string csv_field(std::string_view text) {
  const bool blank_ends = !text.empty() && trimmed(text).size() != text.size();
  if (!blank_ends && text.find_first_of(",\"\r\n") == std::string_view::npos &&
      (text.empty() || text[0] != '#')) {
    return std::string(text);
  }
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + '"';
}

}  // namespace hexcal
