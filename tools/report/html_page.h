#pragma once

#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/report/chart.h"

namespace hexcal {

/// Markup that is safe to put into a page. It is made from text by html_text() (which escapes) and from the
/// report's own building blocks, never from a user's file directly.
struct Html {
  std::string source;
  Html& operator+=(const Html& more) {
    source += more.source;
    return *this;
  }
};

[[nodiscard]] Html html_text(std::string_view text);
/// Element with quoted attributes; `tag` and the attributes' names are literals of the program.
[[nodiscard]] Html html_element(std::string_view tag, const Html& content,
                                const std::vector<std::pair<std::string_view, std::string>>& attributes = {});
[[nodiscard]] Html html_paragraph(std::string_view text);

/// A traffic light in shape and words as well as in colour.
enum class Light { none, good, warning, bad };
[[nodiscard]] const char* light_words(Light light);
/// One word for machines: none, good, warning, bad.
[[nodiscard]] const char* light_name(Light light);

struct HtmlCell {
  std::string text;
  std::optional<double> sort_key;  ///< default: the text
  Light light = Light::none;
  std::string hint;    ///< shown when pointed at
  std::string second;  ///< second line, small: a standard deviation
};
/// A cell with words.
[[nodiscard]] HtmlCell text_cell(std::string text, Light light = Light::none);
/// A number that is not there: number_cell shows it as an empty cell.
inline constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
/// A cell with a number shown to `decimals` places, sorted by its value; NaN is an empty cell.
[[nodiscard]] HtmlCell number_cell(double value, int decimals);
/// A number to so many significant digits, for columns whose rows differ by powers of ten.
[[nodiscard]] HtmlCell significant_cell(double value, int digits);
/// Per cent by which `after` is less than `before`, with as many nines as it takes to tell it from 100.
[[nodiscard]] HtmlCell less_by_cell(double before, double after);

struct HtmlTable {
  struct Column {
    std::string title;
    std::string unit;     ///< second line of the header
    bool numeric = true;  ///< right-aligned
    std::string hint;
  };
  std::string caption;
  std::vector<Column> columns;
  std::vector<std::vector<HtmlCell>> rows;
  bool sortable = true;
  std::size_t highlighted = SIZE_MAX;  ///< row drawn strong
};
[[nodiscard]] Html html_table(const HtmlTable& table);

/// Words with a light before them.
[[nodiscard]] Html html_light(Light light, std::string_view words);

/// Content below a title that opens and closes it; on paper only what is open shows.
[[nodiscard]] Html html_folded(std::string_view title, const Html& content, bool open);

/// Terms with their values, for short lists of facts.
[[nodiscard]] Html html_facts(const std::vector<std::pair<std::string, std::string>>& facts);

/// Versions, commands and hashes, one a line.
[[nodiscard]] Html html_provenance(const std::vector<std::pair<std::string, std::string>>& facts);

/// A chart with its title and caption.
[[nodiscard]] Html html_figure(const Chart& chart);

/// The first thing on the page: one sentence, why, and what to do next.
struct Verdict {
  Light light = Light::none;
  std::string headline;
  std::vector<std::string> findings;    ///< what is wrong or noteworthy, worst first
  std::vector<std::string> next_steps;  ///< in the imperative; commands in `backquotes`
};
[[nodiscard]] Html html_verdict(const Verdict& verdict);

struct HtmlSection {
  std::string id;  ///< anchor: letters, digits and -
  std::string title;
  Html content;
};

/// A page that needs nothing else: style and scripts are inside, nothing is loaded from a network.
struct HtmlPage {
  std::string title;
  std::string subtitle;
  Html verdict;
  std::vector<HtmlSection> sections;
  bool with_scene = false;  ///< puts the 3D library and the viewer's script in
};
[[nodiscard]] std::string render_page(const HtmlPage& page);

}  // namespace hexcal
