#pragma once

#include <chrono>
#include <cstddef>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace hexcal {

/// Colours appear only on a terminal and never when NO_COLOR is set (no-color.org).
enum class Colour { plain, good, warning, bad, dim, bold };
[[nodiscard]] std::string coloured(std::string_view text, Colour colour);

/// A bar with count and time left on standard error, redrawn in place; silent unless that is a terminal.
/// `advance` may be called from any thread.
class ProgressBar {
 public:
  ProgressBar(std::string label, std::size_t total);
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  ~ProgressBar();
  void advance(std::size_t count = 1);

 private:
  void draw() const;

  std::string label_;
  std::size_t total_;
  std::size_t done_ = 0;
  bool shown_;
  std::chrono::steady_clock::time_point start_;
  std::mutex mutex_;
};

/// A table with aligned columns: the first is left-aligned, the others right-aligned.
class TextTable {
 public:
  explicit TextTable(std::vector<std::string> header);
  void add_row(std::vector<std::string> cells, Colour colour = Colour::plain);
  /// Left-aligns a column.
  void align_left(std::size_t column);
  [[nodiscard]] std::string text() const;

 private:
  struct Row {
    std::vector<std::string> cells;
    Colour colour;
  };
  std::vector<std::string> header_;
  std::vector<bool> left_;
  std::vector<Row> rows_;
};

}  // namespace hexcal
