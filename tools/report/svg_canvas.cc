#include "tools/report/svg_canvas.h"

#include <fmt/format.h>

#include <cmath>

#include "tools/report/markup.h"

namespace hexcal {
namespace {

// Hundredths of a pixel are finer than any screen or printer; short numbers keep the page small.
std::string short_number(double value) {
  std::string text = fmt::format("{:.2f}", value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string point_list(std::span<const Eigen::Vector2d> points) {
  std::string out;
  for (const Eigen::Vector2d& p : points) {
    if (!out.empty()) out += ' ';
    out += short_number(p.x()) + ',' + short_number(p.y());
  }
  return out;
}

std::string paint_attributes(const Paint& paint, bool stroke) {
  const char* property = stroke ? "stroke" : "fill";
  std::string out = paint.ink == Ink::exact
                        ? fmt::format(R"( {}="#{:06x}")", property, paint.rgb)
                        : fmt::format(R"( class="{}-{}")", stroke ? 'k' : 'f', ink_name(paint.ink));
  if (paint.opacity < 1) out += fmt::format(R"( {}-opacity="{}")", property, short_number(paint.opacity));
  return out;
}

const char* dashes(const Stroke& stroke) { return stroke.dashed ? R"( stroke-dasharray="4 3")" : ""; }

std::string opening(const Eigen::Vector2d& size, std::string_view title, std::string_view attributes) {
  return fmt::format(
      R"(<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {0} {1}" role="img" aria-label="{2}"{3}>)"
      "<title>{2}</title>\n",
      short_number(size.x()), short_number(size.y()), markup_escaped(title), attributes);
}

}  // namespace

void SvgCanvas::polyline(std::span<const Eigen::Vector2d> points, const Stroke& stroke) {
  elements_ += fmt::format(R"(<polyline points="{}" fill="none"{} stroke-width="{}"{}/>)"
                           "\n",
                           point_list(points), paint_attributes(stroke.paint, true),
                           short_number(stroke.width), dashes(stroke));
}

void SvgCanvas::polylines(std::span<const std::vector<Eigen::Vector2d>> lines, const Stroke& stroke) {
  if (lines.empty()) return;
  std::string path;
  for (const std::vector<Eigen::Vector2d>& line : lines) {
    Eigen::Vector2d last = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < line.size(); ++i) {
      // Steps from where the rounded path stands, so that roundings do not add up.
      const Eigen::Vector2d step = i == 0 ? line[i] : Eigen::Vector2d(line[i] - last);
      const Eigen::Vector2d rounded = (step * 100).array().round().matrix() / 100;
      last = i == 0 ? rounded : Eigen::Vector2d(last + rounded);
      const std::string y = short_number(step.y());
      path += fmt::format("{}{}{}{}",
                          i == 0   ? "M"
                          : i == 1 ? "l"
                                   : " ",
                          short_number(step.x()), y.front() == '-' ? "" : " ", y);
    }
  }
  elements_ +=
      fmt::format(R"(<path d="{}" fill="none"{} stroke-width="{}"{}/>)"
                  "\n",
                  path, paint_attributes(stroke.paint, true), short_number(stroke.width), dashes(stroke));
}

void SvgCanvas::polygon(std::span<const Eigen::Vector2d> points, const Paint& fill) {
  elements_ += fmt::format("<polygon points=\"{}\"{}/>\n", point_list(points), paint_attributes(fill, false));
}

void SvgCanvas::rectangle(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, const Paint& fill) {
  elements_ += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"{}/>\n",
                           short_number(corner.x()), short_number(corner.y()), short_number(size.x()),
                           short_number(size.y()), paint_attributes(fill, false));
}

void SvgCanvas::circle(const Eigen::Vector2d& centre, double radius, const Paint& fill) {
  elements_ += fmt::format("<circle cx=\"{}\" cy=\"{}\" r=\"{}\"{}/>\n", short_number(centre.x()),
                           short_number(centre.y()), short_number(radius), paint_attributes(fill, false));
}

void SvgCanvas::text(const Eigen::Vector2d& at, std::string_view words, const TextStyle& style) {
  const std::string x = short_number(at.x());
  const std::string y = short_number(at.y());
  std::string attributes = fmt::format(R"( x="{}" y="{}" font-size="{}")", x, y, short_number(style.size));
  if (style.anchor != Anchor::start) {
    attributes += fmt::format(R"( text-anchor="{}")", style.anchor == Anchor::middle ? "middle" : "end");
  }
  if (style.bold) attributes += R"( font-weight="600")";
  if (style.turn_deg != 0) {
    attributes += fmt::format(R"~( transform="rotate({} {} {})")~", short_number(style.turn_deg), x, y);
  }
  elements_ += fmt::format("<text{}{}>{}</text>\n", attributes, paint_attributes(style.paint, false),
                           markup_escaped(words));
}

void SvgCanvas::begin_tip(std::string_view words) {
  elements_ += fmt::format("<g class=\"tip\"><title>{}</title>", markup_escaped(words));
}

void SvgCanvas::end_tip() { elements_ += "</g>\n"; }

std::string SvgCanvas::inline_svg(const Eigen::Vector2d& size, std::string_view title) const {
  const std::string style = fmt::format(R"( class="chart" style="max-width:{}px")", short_number(size.x()));
  return opening(size, title, style) + elements_ + "</svg>\n";
}

std::string SvgCanvas::svg_file(const Eigen::Vector2d& size, std::string_view title) const {
  const std::string attributes =
      fmt::format(R"( width="{}" height="{}")", short_number(size.x()), short_number(size.y()));
  // Plain colours and no custom properties: vector editors and LaTeX tool chains do not know those.
  std::string style = "<style>text{font-family:Helvetica,Arial,sans-serif}";
  for (int i = 0; i < static_cast<int>(Ink::exact); ++i) {
    const auto ink = static_cast<Ink>(i);
    style += fmt::format(".f-{0}{{fill:#{1:06x}}}.k-{0}{{stroke:#{1:06x}}}", ink_name(ink), light_rgb(ink));
  }
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n" + opening(size, title, attributes) + style +
         "</style>\n" + elements_ + "</svg>\n";
}

}  // namespace hexcal
