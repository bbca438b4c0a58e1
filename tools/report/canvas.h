#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hexcal {

/// What a mark means, not what it looks like: the page's style sheet gives each ink a light and a dark
/// colour, printed figures take the light one. The series follow Okabe and Ito (2008), told apart by people
/// with any kind of colour vision.
enum class Ink {
  text,
  muted,  ///< axes, second-rank text
  grid,
  surface,  ///< the ground
  good,
  warning,
  bad,
  series0,
  series1,
  series2,
  series3,
  series4,
  series5,
  series6,
  series7,
  exact,  ///< the paint's own rgb, in light and in dark
};

[[nodiscard]] Ink series_ink(int index);
/// 0xRRGGBB on white paper; `exact` has none.
[[nodiscard]] std::uint32_t light_rgb(Ink ink);
/// Short name used in class names of the SVG and in the style sheet's custom properties.
[[nodiscard]] std::string_view ink_name(Ink ink);

struct Paint {
  Ink ink = Ink::text;
  double opacity = 1;
  std::uint32_t rgb = 0;  ///< with Ink::exact
};

struct Stroke {
  Paint paint;
  double width = 1;
  bool dashed = false;
};

enum class Anchor { start, middle, end };

struct TextStyle {
  double size = 11;
  Anchor anchor = Anchor::start;
  Paint paint;
  bool bold = false;
  double turn_deg = 0;  ///< clockwise as drawn
};

/// Something to draw on: x right, y down, in CSS pixels (1/96 inch). Every chart is drawn through this, so
/// that the page, the SVG file and the PDF show the same.
class Canvas {
 public:
  Canvas() = default;
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;
  virtual ~Canvas() = default;

  virtual void polyline(std::span<const Eigen::Vector2d> points, const Stroke& stroke) = 0;
  /// Many lines of one stroke, as one element: thousands of residual vectors stay small.
  virtual void polylines(std::span<const std::vector<Eigen::Vector2d>> lines, const Stroke& stroke) = 0;
  virtual void polygon(std::span<const Eigen::Vector2d> points, const Paint& fill) = 0;
  virtual void rectangle(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, const Paint& fill) = 0;
  virtual void circle(const Eigen::Vector2d& centre, double radius, const Paint& fill) = 0;
  /// `at` is on the text's base line.
  virtual void text(const Eigen::Vector2d& at, std::string_view words, const TextStyle& style) = 0;
  /// What is drawn up to end_tip() shows these words when pointed at.
  virtual void begin_tip(std::string_view words) = 0;
  virtual void end_tip() = 0;

  void line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Stroke& stroke);
};

/// Width in pixels that a text will take, within about 10 % for any sans serif font.
[[nodiscard]] double text_width(std::string_view words, double size);

}  // namespace hexcal
