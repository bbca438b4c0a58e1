#pragma once

#include <memory>
#include <string>

#include "tools/report/canvas.h"

namespace hexcal {

/// Draws on one PDF page of the drawing's own size, in the light colours, with vector text. Tips have no
/// place on paper and are dropped.
class PdfCanvas final : public Canvas {
 public:
  PdfCanvas(const Eigen::Vector2d& size, std::string_view title);
  ~PdfCanvas() override;

  void polyline(std::span<const Eigen::Vector2d> points, const Stroke& stroke) override;
  void polylines(std::span<const std::vector<Eigen::Vector2d>> lines, const Stroke& stroke) override;
  void polygon(std::span<const Eigen::Vector2d> points, const Paint& fill) override;
  void rectangle(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, const Paint& fill) override;
  void circle(const Eigen::Vector2d& centre, double radius, const Paint& fill) override;
  void text(const Eigen::Vector2d& at, std::string_view words, const TextStyle& style) override;
  void begin_tip(std::string_view words) override;
  void end_tip() override;

  /// Ends the page; the file's bytes. Nothing may be drawn afterwards.
  [[nodiscard]] std::string finish();

 private:
  struct Page;
  std::unique_ptr<Page> page_;
};

}  // namespace hexcal
