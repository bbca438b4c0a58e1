#include "tools/hexcal/terminal.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <map>

#include "kinematics/geometry/printable_text.h"
#include "tools/hexcal/printable_output.h"

namespace hexcal {
namespace {

bool colours_wanted() {
  static const bool wanted = [] {
    const char* no_color = std::getenv("NO_COLOR");
    return ::isatty(STDOUT_FILENO) != 0 && (no_color == nullptr || *no_color == '\0');
  }();
  return wanted;
}

const char* escape(Colour colour) {
  switch (colour) {
    case Colour::plain:
      return "";
    case Colour::good:
      return "32m";
    case Colour::warning:
      return "33m";
    case Colour::bad:
      return "31m";
    case Colour::dim:
      return "2m";
    case Colour::bold:
      return "1m";
  }
  return "";
}

// Columns that a text takes on a terminal: UTF-8 continuation bytes take none.
std::size_t shown_width(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(
      text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

constexpr std::size_t kBarWidth = 30;

bool words_silent = false;
int suggestions_held = 0;

}  // namespace

std::string coloured(std::string_view text, Colour colour) {
  if (colour == Colour::plain || !colours_wanted()) return std::string(text);
  return fmt::format("{0}\x1b[{1}{2}{0}\x1b[0m", kOwnSequence, escape(colour), text);
}

void silence_words() {
  words_silent = true;
  silence_output();
}

void suggest_next(const std::string& command) {
  if (suggestions_held == 0) fmt::print("{}\n", coloured("next: " + command, Colour::dim));
}

SuggestionsHeld::SuggestionsHeld() { ++suggestions_held; }
SuggestionsHeld::~SuggestionsHeld() { --suggestions_held; }

std::string shell_word(const std::string& text) {
  const bool plain = !text.empty() && std::all_of(text.begin(), text.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 ||
           std::string_view("/._-+,:=@%").find(static_cast<char>(c)) != std::string::npos;
  });
  if (plain) return text;
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

std::string written_line(const std::vector<std::filesystem::path>& files) {
  std::map<std::string, std::vector<std::string>> by_folder;
  std::vector<std::string> folders;
  for (const std::filesystem::path& file : files) {
    const std::string folder = file.parent_path().string();
    if (by_folder.count(folder) == 0) folders.push_back(folder);
    by_folder[folder].push_back(file.filename().string());
  }
  std::string out;
  for (const std::string& folder : folders)
    out +=
        fmt::format("wrote {}{}\n", folder.empty() ? "" : folder + ": ", fmt::join(by_folder[folder], ", "));
  return out;
}

ProgressBar::ProgressBar(std::string label, std::size_t total)
    : label_(std::move(label)),
      total_(total),
      shown_(!words_silent && total > 0 && ::isatty(STDERR_FILENO) != 0),
      start_(std::chrono::steady_clock::now()) {
  if (shown_) draw();
}

ProgressBar::~ProgressBar() {
  if (!shown_) return;
  fmt::print(stderr, "{0}\r{0}\x1b[K", kOwnSequence);
  std::fflush(stderr);
}

void ProgressBar::advance(std::size_t count) {
  const std::lock_guard<std::mutex> lock(mutex_);
  done_ = std::min(done_ + count, total_);
  if (shown_) draw();
}

void ProgressBar::draw() const {
  const std::size_t filled = kBarWidth * done_ / total_;
  std::string left;
  if (done_ > 0 && done_ < total_) {
    const double elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    const double left_s = elapsed_s * static_cast<double>(total_ - done_) / static_cast<double>(done_);
    left =
        left_s < 60 ? fmt::format("  {:.0f} s left", left_s) : fmt::format("  {:.1f} min left", left_s / 60);
  }
  fmt::print(stderr, "{0}\r{0}\x1b[K{1} [{2:#<{3}}{4: <{5}}] {6}/{7}{8}", kOwnSequence, label_, "", filled,
             "", kBarWidth - filled, done_, total_, left);
  std::fflush(stderr);
}

TextTable::TextTable(std::vector<std::string> header)
    : header_(std::move(header)), left_(header_.size(), false) {
  if (!left_.empty()) left_[0] = true;
}

void TextTable::add_row(std::vector<std::string> cells, Colour colour) {
  cells.resize(header_.size());
  for (std::string& cell : cells) cell = printable_text(cell);  // names of files may hold anything
  rows_.push_back({std::move(cells), colour});
}

void TextTable::align_left(std::size_t column) { left_.at(column) = true; }

std::string TextTable::text() const {
  std::vector<std::size_t> widths;
  for (std::size_t i = 0; i < header_.size(); ++i) {
    std::size_t width = shown_width(header_[i]);
    for (const Row& row : rows_) width = std::max(width, shown_width(row.cells[i]));
    widths.push_back(width);
  }
  const auto line = [&](const std::vector<std::string>& cells) {
    std::string out;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const std::string padding(widths[i] - shown_width(cells[i]), ' ');
      const bool last = i + 1 == cells.size();
      if (i > 0) out += "  ";
      out += left_[i] ? cells[i] + (last ? "" : padding) : padding + cells[i];
    }
    return out;
  };
  std::string out = coloured(line(header_), Colour::bold) + '\n';
  for (const Row& row : rows_) out += coloured(line(row.cells), row.colour) + '\n';
  return out;
}

}  // namespace hexcal
