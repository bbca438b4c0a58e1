#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace hexcal {

/// Colours appear only on a terminal and never when NO_COLOR is set (no-color.org).
enum class Colour { plain, good, warning, bad, dim, bold };
[[nodiscard]] std::string coloured(std::string_view text, Colour colour);

/// `--quiet`: words for people go nowhere from here on, progress included; errors still show. Results are in
/// files and in the exit code.
void silence_words();

/// The last line of a command: what usually comes next, dim.
void suggest_next(const std::string& command);

/// No suggestions while it lives: for commands that are made of others.
class SuggestionsHeld {
 public:
  SuggestionsHeld();
  SuggestionsHeld(const SuggestionsHeld&) = delete;
  SuggestionsHeld& operator=(const SuggestionsHeld&) = delete;
  ~SuggestionsHeld();
};

/// A file's name as a word of a shell: quoted where it must be.
[[nodiscard]] std::string shell_word(const std::string& text);

/// "wrote FOLDER: a.csv, b.csv" for files of one folder, the others by their whole names.
[[nodiscard]] std::string written_line(const std::vector<std::filesystem::path>& files);

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
