#include "tools/report/pdf_canvas.h"

#include <cairo/cairo-pdf.h>

#include <stdexcept>

#include "kinematics/geometry/pose.h"
#include "tools/report/markup.h"

namespace hexcal {
namespace {

constexpr double kPointsPerPixel = 72.0 / 96.0;

cairo_status_t append(void* closure, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(closure)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

void set_paint(cairo_t* context, const Paint& paint) {
  const std::uint32_t rgb = paint.ink == Ink::exact ? paint.rgb : light_rgb(paint.ink);
  const auto channel = [rgb](unsigned shift) { return static_cast<double>((rgb >> shift) & 0xFFU) / 255.0; };
  cairo_set_source_rgba(context, channel(16), channel(8), channel(0), paint.opacity);
}

void add_path(cairo_t* context, std::span<const Eigen::Vector2d> points) {
  cairo_new_path(context);
  for (const Eigen::Vector2d& p : points) cairo_line_to(context, p.x(), p.y());
}

}  // namespace

struct PdfCanvas::Page {
  std::string bytes;
  cairo_surface_t* surface = nullptr;
  cairo_t* context = nullptr;

  void close() {
    if (context != nullptr) cairo_destroy(context);
    if (surface != nullptr) cairo_surface_destroy(surface);
    context = nullptr;
    surface = nullptr;
  }
};

PdfCanvas::PdfCanvas(const Eigen::Vector2d& size, std::string_view title) : page_(std::make_unique<Page>()) {
  page_->surface = cairo_pdf_surface_create_for_stream(append, &page_->bytes, size.x() * kPointsPerPixel,
                                                       size.y() * kPointsPerPixel);
  cairo_pdf_surface_set_metadata(page_->surface, CAIRO_PDF_METADATA_TITLE, clean_text(title).c_str());
  // A fixed date: the same drawing gives the same bytes.
  cairo_pdf_surface_set_metadata(page_->surface, CAIRO_PDF_METADATA_CREATE_DATE, "2000-01-01T00:00:00Z");
  page_->context = cairo_create(page_->surface);
  cairo_scale(page_->context, kPointsPerPixel, kPointsPerPixel);
}

PdfCanvas::~PdfCanvas() { page_->close(); }

void PdfCanvas::polyline(std::span<const Eigen::Vector2d> points, const Stroke& stroke) {
  add_path(page_->context, points);
  set_paint(page_->context, stroke.paint);
  cairo_set_line_width(page_->context, stroke.width);
  const double dashes[] = {4, 3};
  cairo_set_dash(page_->context, dashes, stroke.dashed ? 2 : 0, 0);
  cairo_stroke(page_->context);
}

void PdfCanvas::polylines(std::span<const std::vector<Eigen::Vector2d>> lines, const Stroke& stroke) {
  for (const std::vector<Eigen::Vector2d>& line : lines) polyline(line, stroke);
}

void PdfCanvas::polygon(std::span<const Eigen::Vector2d> points, const Paint& fill) {
  add_path(page_->context, points);
  cairo_close_path(page_->context);
  set_paint(page_->context, fill);
  cairo_fill(page_->context);
}

void PdfCanvas::rectangle(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, const Paint& fill) {
  cairo_new_path(page_->context);
  cairo_rectangle(page_->context, corner.x(), corner.y(), size.x(), size.y());
  set_paint(page_->context, fill);
  cairo_fill(page_->context);
}

void PdfCanvas::circle(const Eigen::Vector2d& centre, double radius, const Paint& fill) {
  cairo_new_path(page_->context);
  cairo_arc(page_->context, centre.x(), centre.y(), radius, 0, 2 * 180 * kRadPerDeg);
  set_paint(page_->context, fill);
  cairo_fill(page_->context);
}

void PdfCanvas::text(const Eigen::Vector2d& at, std::string_view words, const TextStyle& style) {
  cairo_t* context = page_->context;
  const std::string text = clean_text(words);  // malformed UTF-8 would put cairo into its error state
  cairo_select_font_face(context, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                         style.bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(context, style.size);
  set_paint(context, style.paint);
  cairo_text_extents_t extents;
  cairo_text_extents(context, text.c_str(), &extents);
  const double share = style.anchor == Anchor::start ? 0 : style.anchor == Anchor::middle ? 0.5 : 1;
  cairo_save(context);
  cairo_translate(context, at.x(), at.y());
  cairo_rotate(context, style.turn_deg * kRadPerDeg);
  cairo_move_to(context, -share * extents.x_advance, 0);
  cairo_show_text(context, text.c_str());
  cairo_restore(context);
}

void PdfCanvas::begin_tip(std::string_view) {}
void PdfCanvas::end_tip() {}

std::string PdfCanvas::finish() {
  cairo_show_page(page_->context);
  const cairo_status_t status = cairo_status(page_->context);
  cairo_surface_finish(page_->surface);
  page_->close();
  if (status != CAIRO_STATUS_SUCCESS) {
    throw std::runtime_error(std::string("cairo: ") + cairo_status_to_string(status));
  }
  return page_->bytes;
}

}  // namespace hexcal
