#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "photogrammetry/photograph/input_file.h"

namespace hexcal {

/// A CSV table with named columns. Lines that begin with '#' are comments; fields may be quoted; blank lines
/// and what spreadsheets write (csv_dialect.h: semicolons, tabs, decimal commas, UTF-16, any line ends) are
/// accepted; control characters in a field become printable_text. All errors are InputError and name file,
/// line and column.
class CsvTable {
 public:
  [[nodiscard]] static CsvTable read(const std::filesystem::path& path, ReadFor purpose = ReadFor::input);
  [[nodiscard]] static CsvTable parse(std::string_view bytes, const std::filesystem::path& path);

  [[nodiscard]] std::size_t rows() const { return rows_.size(); }
  [[nodiscard]] bool has_column(std::string_view name) const;
  /// Throws if a column is missing, naming it and those found.
  void require_columns(const std::vector<std::string>& names) const;

  [[nodiscard]] const std::string& text(std::size_t row, std::string_view column) const;
  /// A finite number.
  [[nodiscard]] double number(std::size_t row, std::string_view column) const;
  /// Empty or "nan" means absent.
  [[nodiscard]] std::optional<double> optional_number(std::size_t row, std::string_view column) const;
  [[nodiscard]] int integer(std::size_t row, std::string_view column) const;

  /// Error that names file, line and column.
  [[noreturn]] void fail(std::size_t row, std::string_view column, const std::string& message) const;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] const std::vector<std::string>& columns() const { return columns_; }
  [[nodiscard]] const std::vector<std::string>& comments() const { return comments_; }

 private:
  struct Row {
    int line = 0;
    std::vector<std::string> fields;
  };
  [[nodiscard]] std::size_t column_index(std::string_view name) const;

  std::filesystem::path path_;
  char separator_ = ',';
  std::vector<std::string> columns_;
  std::vector<std::string> comments_;
  std::vector<Row> rows_;
};

/// A field as it must be written: quoted if it holds a comma, quote or line break, or begins or ends blank.
[[nodiscard]] std::string csv_field(std::string_view text);

}  // namespace hexcal
