#pragma once

#include <string>

#include "tools/report/canvas.h"

namespace hexcal {

/// Writes what is drawn as SVG elements. Colours are classes, so that a page can restyle them.
class SvgCanvas final : public Canvas {
 public:
  void polyline(std::span<const Eigen::Vector2d> points, const Stroke& stroke) override;
  void polylines(std::span<const std::vector<Eigen::Vector2d>> lines, const Stroke& stroke) override;
  void polygon(std::span<const Eigen::Vector2d> points, const Paint& fill) override;
  void rectangle(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, const Paint& fill) override;
  void circle(const Eigen::Vector2d& centre, double radius, const Paint& fill) override;
  void text(const Eigen::Vector2d& at, std::string_view words, const TextStyle& style) override;
  void begin_tip(std::string_view words) override;
  void end_tip() override;

  /// The <svg> element for a page whose style sheet knows the inks; `title` is read out by screen readers.
  [[nodiscard]] std::string inline_svg(const Eigen::Vector2d& size, std::string_view title) const;
  /// A complete SVG file with the light colours.
  [[nodiscard]] std::string svg_file(const Eigen::Vector2d& size, std::string_view title) const;

 private:
  std::string elements_;
};

}  // namespace hexcal
