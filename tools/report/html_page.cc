#include "tools/report/html_page.h"

#include <fmt/format.h>

#include <cassert>
#include <cmath>

#include "tools/report/markup.h"
#include "tools/report/page_resources.h"

namespace hexcal {
namespace {

// Words with `backquoted` parts as code.
Html with_code(std::string_view text) {
  Html out;
  bool code = false;
  while (true) {
    const std::size_t quote = text.find('`');
    const Html part = html_text(text.substr(0, quote));
    out += code ? html_element("code", part) : part;
    if (quote == std::string_view::npos) return out;
    text.remove_prefix(quote + 1);
    code = !code;
  }
}

Html light_mark(Light light) {
  return {fmt::format(R"(<span class="light {}" aria-hidden="true"></span>)", light_name(light))};
}

Html table_head(const HtmlTable& table) {
  std::string out;
  for (const HtmlTable::Column& column : table.columns) {
    std::string title = markup_escaped(column.title);
    if (!column.unit.empty())
      title += fmt::format(R"(<span class="unit">{}</span>)", markup_escaped(column.unit));
    if (table.sortable) title = "<button type=\"button\">" + title + "</button>";
    out += fmt::format(R"(<th scope="col"{}{}>{}</th>)", column.numeric ? "" : R"( class="words")",
                       column.hint.empty() ? "" : " title=\"" + markup_escaped(column.hint) + '"', title);
  }
  return {"<thead><tr>" + out + "</tr></thead>"};
}

constexpr std::size_t kLongWords = 28;  // bytes; longer words wrap
constexpr std::size_t kLongTable = 24;  // rows; a longer table scrolls by itself

Html table_cell(const HtmlCell& cell, bool numeric, bool row_header) {
  std::string attributes = numeric                         ? ""
                           : cell.text.size() > kLongWords ? R"( class="words long")"
                                                           : R"( class="words")";
  if (cell.sort_key) attributes += fmt::format(R"( data-v="{:.9g}")", *cell.sort_key);
  if (!cell.hint.empty()) attributes += " title=\"" + markup_escaped(cell.hint) + '"';
  if (row_header) attributes += R"( scope="row")";
  Html content;
  if (cell.light != Light::none) content += light_mark(cell.light);
  content += html_text(cell.text);
  if (!cell.second.empty()) content += html_element("span", html_text(cell.second), {{"class", "unit"}});
  return {fmt::format("<{0}{1}>{2}</{0}>", row_header ? "th" : "td", attributes, content.source)};
}

}  // namespace

Html html_text(std::string_view text) { return {markup_escaped(text)}; }

Html html_element(std::string_view tag, const Html& content,
                  const std::vector<std::pair<std::string_view, std::string>>& attributes) {
  std::string out = fmt::format("<{}", tag);
  for (const auto& [name, value] : attributes) out += fmt::format(" {}=\"{}\"", name, markup_escaped(value));
  return {fmt::format("{}>{}</{}>", out, content.source, tag)};
}

Html html_paragraph(std::string_view text) { return html_element("p", with_code(text)); }

const char* light_name(Light light) {
  switch (light) {
    case Light::none:
      return "none";
    case Light::good:
      return "good";
    case Light::warning:
      return "warning";
    case Light::bad:
      return "bad";
  }
  return "none";
}

const char* light_words(Light light) {
  switch (light) {
    case Light::none:
      return "Not judged";
    case Light::good:
      return "Good";
    case Light::warning:
      return "Usable, with reservations";
    case Light::bad:
      return "Not usable";
  }
  return "";
}

HtmlCell text_cell(std::string text, Light light) {
  HtmlCell cell;
  cell.text = std::move(text);
  cell.light = light;
  return cell;
}

HtmlCell number_cell(double value, int decimals) {
  if (!std::isfinite(value)) return {};
  HtmlCell cell;
  cell.text = number_text(value, std::pow(10.0, -decimals));
  cell.sort_key = value;
  return cell;
}

HtmlCell significant_cell(double value, int digits) {
  if (!std::isfinite(value)) return {};
  HtmlCell cell;
  cell.text = significant_text(value, digits);
  cell.sort_key = value;
  return cell;
}

HtmlCell less_by_cell(double before, double after) {
  if (!std::isfinite(after) || !(before > 0)) return {};
  HtmlCell cell;
  cell.text = less_by_text(before, after);
  cell.sort_key = 1 - after / before;
  return cell;
}

Html html_table(const HtmlTable& table) {
  std::string rows;
  for (std::size_t r = 0; r < table.rows.size(); ++r) {
    assert(table.rows[r].size() == table.columns.size());
    rows += r == table.highlighted ? "<tr class=\"strong\">" : "<tr>";
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
      rows += table_cell(table.rows[r][c], table.columns[c].numeric, c == 0).source;
    }
    rows += "</tr>\n";
  }
  const std::string caption =
      table.caption.empty() ? "" : "<caption>" + markup_escaped(table.caption) + "</caption>";
  return {
      fmt::format("<div class=\"scroll{}\" tabindex=\"0\" role=\"group\" "
                  "aria-label=\"{}\"><table{}>{}{}<tbody>\n{}</tbody></table></div>\n",
                  table.rows.size() > kLongTable ? " tall" : "", markup_escaped(table.caption),
                  table.sortable ? " class=\"sortable\"" : "", caption, table_head(table).source, rows)};
}

Html html_light(Light light, std::string_view words) {
  return {light_mark(light).source + html_text(words).source};
}

Html html_folded(std::string_view title, const Html& content, bool open) {
  const Html summary = html_element("summary", html_text(title));
  return {fmt::format("<details{}>{}{}</details>\n", open ? " open=\"open\"" : "", summary.source,
                      content.source)};
}

Html html_facts(const std::vector<std::pair<std::string, std::string>>& facts) {
  Html out;
  for (const auto& [term, value] : facts) {
    out += html_element(
        "div", {html_element("dt", html_text(term)).source + html_element("dd", with_code(value)).source});
  }
  return html_element("dl", out, {{"class", "facts"}});
}

Html html_provenance(const std::vector<std::pair<std::string, std::string>>& facts) {
  if (facts.empty()) return {};
  Html rows;
  for (const auto& [term, value] : facts) {
    const Html head = html_element("th", html_text(term), {{"scope", "row"}, {"class", "words"}});
    const Html cell = html_element("td", html_element("code", html_text(value)), {{"class", "words long"}});
    rows += html_element("tr", {head.source + cell.source});
  }
  return html_element("table", html_element("tbody", rows), {{"class", "provenance"}});
}

Html html_figure(const Chart& chart) {
  Html content = html_element("h3", html_text(chart.title));
  content += Html{chart_inline_svg(chart)};
  if (!chart.caption.empty()) content += html_element("figcaption", with_code(chart.caption));
  return html_element("figure", content, {{"id", chart.id}});
}

Html html_verdict(const Verdict& verdict) {
  Html content = html_element("p",
                              {light_mark(verdict.light).source +
                               html_element("strong", html_text(light_words(verdict.light))).source},
                              {{"class", "light-line"}});
  content += html_element("p", with_code(verdict.headline), {{"class", "headline"}});
  const auto list = [&](std::string_view title, const std::vector<std::string>& items) {
    if (items.empty()) return;
    Html entries;
    for (const std::string& item : items) entries += html_element("li", with_code(item));
    content += html_element("h2", html_text(title));
    content += html_element("ul", entries);
  };
  list("What was found", verdict.findings);
  list("What to do next", verdict.next_steps);
  return html_element("section", content,
                      {{"class", fmt::format("verdict {}", light_name(verdict.light))}, {"id", "verdict"}});
}

std::string render_page(const HtmlPage& page) {
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta name=\"color-scheme\" content=\"light dark\">\n"
      // Nothing may be fetched, whatever a file name or a table says.
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data: blob:; "
      "style-src 'unsafe-inline'; script-src 'unsafe-inline'\">\n"
      "<link rel=\"icon\" href=\"data:,\">\n";
  out += fmt::format("<title>{}</title>\n<style>\n{}</style>\n</head>\n<body>\n", markup_escaped(page.title),
                     resource(Resource::style));
  out += "<a class=\"skip\" href=\"#main\">Skip to the report</a>\n";
  out += fmt::format("<header><h1>{}</h1><p>{}</p></header>\n", markup_escaped(page.title),
                     markup_escaped(page.subtitle));
  out += "<nav aria-label=\"Sections\"><ul>";
  for (const HtmlSection& section : page.sections) {
    out += fmt::format("<li><a href=\"#{}\">{}</a></li>", markup_escaped(section.id),
                       markup_escaped(section.title));
  }
  out += "</ul></nav>\n<main id=\"main\">\n" + page.verdict.source;
  for (const HtmlSection& section : page.sections) {
    out += fmt::format(
        "\n<section id=\"{0}\" aria-labelledby=\"{0}-title\"><h2 id=\"{0}-title\">{1}</h2>\n{2}</section>\n",
        markup_escaped(section.id), markup_escaped(section.title), section.content.source);
  }
  out += fmt::format("</main>\n<script>\n{}</script>\n", resource(Resource::script));
  if (page.with_scene) {
    out +=
        fmt::format("<script type=\"text/plain\" id=\"three-licence\">\n{}</script>\n<script>\n{}</script>\n",
                    resource(Resource::three_licence), resource(Resource::three));
    out += fmt::format("<script>\n{}</script>\n", resource(Resource::scene_script));
  }
  return out + "</body>\n</html>\n";
}

}  // namespace hexcal
