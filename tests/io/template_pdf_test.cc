#include "tools/io/template_pdf.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "kinematics/geometry/input_error.h"
#include "tests/support/temporary_folder.h"
#include "tools/io/atomic_file.h"

namespace hexcal {
namespace {

Sheet grid(int columns, int rows) {
  Sheet sheet;
  sheet.kind = SheetKind::aprilgrid;
  sheet.family = "tag36h11";
  sheet.columns = columns;
  sheet.rows = rows;
  sheet.marker_mm = 40;
  sheet.spacing_mm = 15;
  return sheet;
}

TEST(TemplatePdf, SameSheetSameBytes) {
  const TemplatePdfOptions options;
  const std::string first = template_pdf({grid(2, 3)}, options);
  EXPECT_EQ(first.substr(0, 5), "%PDF-");
  EXPECT_EQ(first, template_pdf({grid(2, 3)}, options));
}

TEST(TemplatePdf, PaperNamesAndSizes) {
  EXPECT_DOUBLE_EQ(paper_size("a3")->height_mm, 420);
  EXPECT_DOUBLE_EQ(paper_size("600x400.5")->height_mm, 400.5);
  EXPECT_FALSE(paper_size("A9"));
  EXPECT_FALSE(paper_size("0x100"));
  EXPECT_THROW((TemplatePdfOptions{.paper_mm = {80, 200}}.validate()), InputError);
}

TEST(TemplatePdf, LargestGridFillsOnePageAndMoreIsTiled) {
  const TemplatePdfOptions options;
  const auto [columns, rows] = largest_grid(grid(1, 1), options);
  EXPECT_EQ(columns, 3);
  EXPECT_EQ(rows, 4);
  const TemplateTiles one = template_tiles(grid(columns, rows), options);
  EXPECT_EQ(one.columns * one.rows, 1);
  const TemplateTiles more = template_tiles(grid(columns + 1, rows), options);
  EXPECT_EQ(more.columns, 2);
}

// Dark-light transitions along a line of a rendered page, in mm; subpixel from the antialiased grey values.
std::vector<double> edges_mm(const cv::Mat& line, double px_per_mm) {
  std::vector<double> edges;
  const auto* v = line.ptr<std::uint8_t>();
  int from = v[0] > 127 ? 255 : 0;
  for (int i = 1; i + 1 < line.cols; ++i) {
    const int to = 255 - from;
    if ((v[i + 1] > 250 || v[i + 1] < 5) && (v[i + 1] > 127) == (to > 127)) {
      // Pixel i is the mixed one (or pure): its share of the old colour places the edge.
      const double share = static_cast<double>(v[i] - to) / (from - to);
      edges.push_back((i + share) / px_per_mm);
      from = to;
    }
  }
  return edges;
}

TEST(TemplatePdf, PrintedEdgesAreTrueToAHundredthMillimetre) {
  if (std::system("pdftoppm -v >/dev/null 2>&1") != 0) GTEST_SKIP() << "pdftoppm is not installed";
  const TemporaryFolder folder;
  const auto pdf = folder.path() / "sheet.pdf";
  write_file_atomically(pdf, template_pdf({grid(2, 3)}, {}));
  const std::string command =
      "pdftoppm -r 600 -gray '" + pdf.string() + "' '" + (folder.path() / "page").string() + "'";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const cv::Mat page = cv::imread((folder.path() / "page-1.pgm").string(), cv::IMREAD_GRAYSCALE);
  ASSERT_FALSE(page.empty());
  const double px_per_mm = 600 / 25.4;
  const TemplateCanvas canvas = template_canvas(grid(2, 3));
  const Eigen::Vector2d centre =
      canvas.pattern_centre_mm + 0.5 * Eigen::Vector2d(210 - canvas.width_mm, 297 - canvas.height_mm);
  // Through the top black border (5 mm wide) of the first row of tags: black from -47.5 to -7.5 and 7.5
  // to 47.5.
  const int row = static_cast<int>((centre.y() - 72.5) * px_per_mm);
  const auto edges = edges_mm(page.row(row), px_per_mm);
  ASSERT_GE(edges.size(), 4u);
  const double expected[] = {-47.5, -7.5, 7.5, 47.5};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(edges[i] - centre.x(), expected[i], 0.01);
  // And down the left border of the first column.
  cv::Mat column = page.col(static_cast<int>((centre.x() - 45.0) * px_per_mm)).clone().reshape(1, 1);
  const auto down = edges_mm(column, px_per_mm);
  const double expected_down[] = {-75, -35, -20, 20, 35, 75};
  ASSERT_GE(down.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(down[i] - centre.y(), expected_down[i], 0.01);
}

}  // namespace
}  // namespace hexcal
