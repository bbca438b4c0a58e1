#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hexcal {

/// One CSV row on its way through a command: its id and the wanted numbers.
struct StreamedRow {
  std::string_view id;
  std::span<const double> numbers;
};

struct RowTransform {
  std::string id_column = "pose";
  std::vector<std::string> columns;  ///< of the input, found by name
  std::string header;                ///< of the output, with its line break
  /// Appends the output's line (or lines) to `out` and tells whether the row succeeded. Called from several
  /// threads.
  std::function<bool(const StreamedRow& row, std::string& out)> row;
};

struct StreamTally {
  std::size_t rows = 0;
  std::size_t failed = 0;
  std::string first_failed;  ///< id of the first row that did not succeed
};

/// Sends every row of a CSV file (the dialect of csv_table.h) through `transform` into another file. Memory
/// does not grow with the file; rows keep their order and the output's bytes do not depend on the number of
/// threads. The output is written to a temporary name and renamed. An id that stands twice among the first
/// half million is an error. `head` is the output's comment line without its line break; the input's name and
/// SHA-256 are added to it. Throws InputError naming file, line and column.
[[nodiscard]] StreamTally stream_rows(const std::filesystem::path& input, const std::filesystem::path& output,
                                      const std::string& head, const RowTransform& transform, int threads);

/// Appends a number with a fixed count of decimals.
void append_number(std::string& out, double value, int decimals);

}  // namespace hexcal
