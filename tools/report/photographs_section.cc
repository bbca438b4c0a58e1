#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kinematics/geometry/median.h"
#include "tools/report/axis_ticks.h"
#include "tools/report/markup.h"
#include "tools/report/report_sections.h"
#include "tools/report/svg_canvas.h"

namespace hexcal {
namespace {

constexpr double kPictureWidth = 320;
// A typical photograph's residuals are drawn as long as this share of the picture.
constexpr double kTypicalResidualShare = 0.03;
// More photographs than this are folded away, but for those that need a look.
constexpr std::size_t kMostUnfolded = 40;

std::string base64(const std::string& bytes) {
  static constexpr char kAlphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group = (group << 8U) | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      out += k <= bytes.size() - i ? kAlphabet[(group >> (18U - 6U * k)) & 63U] : '=';
    }
  }
  return out;
}

bool is_used(const PhotographPart& photograph) {
  return photograph.status == "ok" || is_suspect(photograph.status);
}

double typical_rms_px(const NetworkPart& network) {
  std::vector<double> values;
  for (const PhotographPart& photograph : network.photographs) {
    if (is_used(photograph)) values.push_back(photograph.rms_px);
  }
  return median(std::move(values));
}

// Sensor pixels per pixel of residual.
double residual_stretch(const NetworkPart& network) {
  double width = 0;
  for (const PhotographPart& photograph : network.photographs)
    width = std::max(width, photograph.size_px.x());
  const double typical = typical_rms_px(network);
  return typical > 0 && width > 0 ? round_number_below(kTypicalResidualShare * width / typical) : 1;
}

// Why a person should look at a photograph; empty for one like the others.
std::string look_words(const PhotographPart& photograph) {
  return photograph.status != "ok" ? status_text(photograph.status) : photograph.remarks;
}

Light photograph_light(const PhotographPart& photograph, const std::string& words) {
  return photograph.status != "ok" ? Light::bad : words.empty() ? Light::good : Light::warning;
}

void draw_outlines(const PhotographPart& photograph, double scale, bool used, Canvas& canvas) {
  std::vector<std::vector<Eigen::Vector2d>> lines;
  for (const MarkerOutline& outline : photograph.outlines) {
    if (outline.used != used) continue;
    std::vector<Eigen::Vector2d> points;
    for (const Eigen::Vector2d& corner : outline.corners_px) points.push_back(scale * corner);
    points.push_back(points.front());
    if (!used) canvas.begin_tip(fmt::format("marker {}: {}", outline.id, outline.words));
    if (!used) canvas.polyline(points, {{Ink::series1}, 1.6, true});
    if (!used) canvas.end_tip();
    if (used) lines.push_back(std::move(points));
  }
  canvas.polylines(lines, {{Ink::series5}, 1.2});
}

// The photograph (or its empty frame) with markers and stretched residuals drawn in.
Html photograph_figure(const PhotographPart& photograph, double stretch, const std::string& words) {
  const double scale = kPictureWidth / photograph.size_px.x();
  const Eigen::Vector2d size = scale * photograph.size_px;
  SvgCanvas canvas;
  draw_outlines(photograph, scale, true, canvas);
  std::vector<std::vector<Eigen::Vector2d>> arrows;
  for (const CornerResidual& corner : photograph.residuals)
    arrows.push_back({scale * corner.at_px, scale * (corner.at_px + stretch * corner.by_px)});
  canvas.polylines(arrows, {{Ink::series4}, 1});
  draw_outlines(photograph, scale, false, canvas);
  std::string svg = canvas.inline_svg(size, photograph.name + " with its markers");
  if (!photograph.thumbnail_jpeg.empty()) {
    const std::string image =
        fmt::format("<image width=\"{:.1f}\" height=\"{:.1f}\" href=\"data:image/jpeg;base64,{}\"/>",
                    size.x(), size.y(), base64(photograph.thumbnail_jpeg));
    svg.insert(svg.find("</title>") + 8, image);
  }
  std::string caption = photograph.name;
  if (is_used(photograph)) {
    caption +=
        fmt::format(": {} markers, {} px rms", photograph.markers, significant_text(photograph.rms_px, 2));
  }
  Html content{svg};
  content += html_element("figcaption", html_light(photograph_light(photograph, words), caption));
  if (!words.empty()) content += html_element("figcaption", html_text(words), {{"class", "words"}});
  return html_element("figure", content);
}

HtmlTable photograph_table(const NetworkPart& network) {
  HtmlTable table;
  table.caption = "What each photograph contributed";
  table.columns = {{"photograph", "", false, ""},    {"pose", "", false, ""},
                   {"markers", "", true, "used"},    {"rejected", "", true, "seen, but against the rest"},
                   {"residual", "px rms", true, ""}, {"verdict", "", false, ""}};
  for (const PhotographPart& photograph : network.photographs) {
    const std::string words = look_words(photograph);
    HtmlCell verdict = text_cell(words.empty() ? "good" : words, photograph_light(photograph, words));
    verdict.sort_key = static_cast<double>(verdict.light);
    const bool used = is_used(photograph);
    table.rows.push_back({text_cell(photograph.name), text_cell(photograph.pose_id),
                          number_cell(photograph.markers, 0), number_cell(photograph.rejected, 0),
                          number_cell(used ? photograph.rms_px : kNoNumber, 4), verdict});
  }
  return table;
}

}  // namespace

Html photographs_section(const NetworkPart& network) {
  const double stretch = residual_stretch(network);
  Html suspects, others;
  std::size_t suspect_count = 0;
  for (const PhotographPart& photograph : network.photographs) {
    if (!(photograph.size_px.x() > 0)) continue;
    const std::string words = look_words(photograph);
    (words.empty() ? others : suspects) += photograph_figure(photograph, stretch, words);
    suspect_count += words.empty() ? 0 : 1;
  }
  Html out = html_table(photograph_table(network));
  out += html_paragraph(fmt::format(
      "In the pictures, light blue: markers used; vermilion, dashed: markers left out (point at one to read "
      "why); orange: residuals, {} times enlarged. `hexcal measure --overlays` draws them at full size.",
      significant_text(stretch, 1)));
  if (suspect_count > 0) {
    out += html_element("h3", html_text("Photographs that need a look"));
    out += html_element("div", suspects, {{"class", "photographs"}});
  }
  if (others.source.empty()) return out;
  const std::size_t count = network.photographs.size() - suspect_count;
  const std::string title = suspect_count > 0 ? "The other photographs" : "Every photograph";
  out += html_folded(fmt::format("{} ({})", title, count),
                     html_element("div", others, {{"class", "photographs"}}), count <= kMostUnfolded);
  return out;
}

}  // namespace hexcal
