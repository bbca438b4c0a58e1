#include "tools/hexcal/slice_picture.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <vector>

#include "tools/io/pose_table.h"

namespace hexcal {
namespace {

constexpr double kLeft = 80;
constexpr double kTop = 30;
constexpr double kSide = 480;

// Colours that differ in lightness too.
const char* colour(PoseVerdict verdict) {
  switch (verdict) {
    case PoseVerdict::reachable:
      return "#2a9d5c";
    case PoseVerdict::too_short:
      return "#cfe2f3";
    case PoseVerdict::too_long:
      return "#9fc5e8";
    case PoseVerdict::base_joint:
      return "#f9cb9c";
    case PoseVerdict::platform_joint:
      return "#e69138";
    case PoseVerdict::legs_collide:
      return "#8e7cc3";
    case PoseVerdict::grips_collide:
      return "#bf9000";
    case PoseVerdict::beyond_singular:
      return "#660000";
    case PoseVerdict::near_singular:
      return "#e06666";
    case PoseVerdict::not_a_pose:
      return "#000000";
  }
  return "#000000";
}

constexpr std::array kAll{
    PoseVerdict::reachable,     PoseVerdict::too_short,       PoseVerdict::too_long,
    PoseVerdict::base_joint,    PoseVerdict::platform_joint,  PoseVerdict::legs_collide,
    PoseVerdict::grips_collide, PoseVerdict::beyond_singular, PoseVerdict::near_singular};

double shown(int axis, double value) { return axis < 3 ? value : value * kDegPerRad; }

// Round numbers in a range, four to ten of them.
std::vector<double> ticks(double low, double high) {
  const double span = high - low;
  if (!(span > 0)) return {low};
  double step = std::pow(10, std::floor(std::log10(span)));
  for (const double part : {0.5, 0.4, 0.5}) {
    if (span / step < 4) step *= part;
  }
  std::vector<double> values;
  for (double n = std::ceil(low / step); n * step <= high; ++n) values.push_back(n * step + 0.0);
  return values;
}

}  // namespace

std::string slice_picture(const std::vector<SliceCell>& cells, const SliceOptions& options) {
  const double width = kSide / options.u_count;
  const double height = kSide / options.v_count;
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"sans-serif\" "
      "font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n",
      kLeft + kSide + 160, kTop + kSide + 60);
  // One rectangle per run of equal cells in a row.
  svg += "<g shape-rendering=\"crispEdges\">\n";
  for (int j = 0; j < options.v_count; ++j) {
    const auto verdict = [&](int i) {
      return cells[static_cast<std::size_t>(j) * static_cast<std::size_t>(options.u_count) +
                   static_cast<std::size_t>(i)]
          .verdict;
    };
    for (int i = 0; i < options.u_count;) {
      int end = i + 1;
      while (end < options.u_count && verdict(end) == verdict(i)) ++end;
      svg += fmt::format("<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" fill=\"{}\"/>\n",
                         kLeft + i * width, kTop + kSide - (j + 1) * height, (end - i) * width + 0.2,
                         height + 0.2, colour(verdict(i)));
      i = end;
    }
  }
  svg += "</g>\n";
  const double u_low = shown(options.axis_u, options.u_low);
  const double u_high = shown(options.axis_u, options.u_high);
  const double v_low = shown(options.axis_v, options.v_low);
  const double v_high = shown(options.axis_v, options.v_high);
  const auto across = [&](double u) { return kLeft + (u - u_low) / (u_high - u_low) * kSide; };
  const auto down = [&](double v) { return kTop + kSide - (v - v_low) / (v_high - v_low) * kSide; };
  for (const double u : ticks(u_low, u_high)) {
    svg += fmt::format(
        "<path d=\"M{0:.1f} {1:.1f}v5\" stroke=\"#000000\"/><text x=\"{0:.1f}\" y=\"{2:.1f}\" "
        "text-anchor=\"middle\">{3:g}</text>\n",
        across(u), kTop + kSide, kTop + kSide + 18, u);
  }
  for (const double v : ticks(v_low, v_high)) {
    svg += fmt::format(
        "<path d=\"M{0:.1f} {1:.1f}h-5\" stroke=\"#000000\"/><text x=\"{2:.1f}\" y=\"{3:.1f}\" "
        "text-anchor=\"end\">{4:g}</text>\n",
        kLeft, down(v), kLeft - 8, down(v) + 4, v);
  }
  if (u_low < 0 && u_high > 0 && v_low < 0 && v_high > 0) {
    svg += fmt::format(
        "<path d=\"M{:.1f} {:.1f}m-6 0h12m-6 -6v12\" stroke=\"#000000\" stroke-width=\"1.5\"><title>home"
        "</title></path>\n",
        across(0), down(0));
  }
  std::string others;
  const Vector6d centre = options.centre.vector();
  for (int k = 0; k < 6; ++k) {
    if (k == options.axis_u || k == options.axis_v) continue;
    others += fmt::format("{}{} {:g}", others.empty() ? "at " : ", ",
                          kPoseColumns[static_cast<std::size_t>(k)], shown(k, centre[k]));
  }
  svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n", kLeft + kSide / 2,
                     kTop - 10, others);
  svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n", kLeft + kSide / 2,
                     kTop + kSide + 42, kPoseColumns[static_cast<std::size_t>(options.axis_u)]);
  svg +=
      fmt::format("<text transform=\"translate(18 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                  kTop + kSide / 2, kPoseColumns[static_cast<std::size_t>(options.axis_v)]);
  double y = kTop + 10;
  for (const PoseVerdict verdict : kAll) {
    svg += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"14\" height=\"14\" fill=\"{}\"/><text x=\"{:.1f}\" "
        "y=\"{:.1f}\">{}</text>\n",
        kLeft + kSide + 16, y, colour(verdict), kLeft + kSide + 36, y + 11, name(verdict));
    y += 22;
  }
  return svg + "</svg>\n";
}

}  // namespace hexcal
