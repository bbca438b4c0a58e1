#include "tools/report/chart.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/report/sample_charts.h"
#include "tests/report/well_formed.h"
#include "tools/report/axis_ticks.h"
#include "tools/report/markup.h"
#include "tools/report/pdf_canvas.h"

namespace hexcal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

TEST(Markup, EscapesEverythingThatCouldBecomeMarkup) {
  EXPECT_EQ(markup_escaped("<b a='1' c=\"2\">&"), "&lt;b a=&#39;1&#39; c=&quot;2&quot;&gt;&amp;");
}

TEST(Markup, DropsControlCharactersAndMarksMalformedUtf8) {
  EXPECT_EQ(clean_text(std::string("a\x01\x00"
                                   "b",
                                   4)),
            "ab");
  EXPECT_EQ(clean_text("\xC2\xB1\xFF"
                       "c"),
            "\xC2\xB1\xEF\xBF\xBD"
            "c");
  EXPECT_EQ(clean_text("\xE2\x82"), "\xEF\xBF\xBD\xEF\xBF\xBD");
  EXPECT_EQ(clean_text("\xC0\xAF"), "\xEF\xBF\xBD\xEF\xBF\xBD");  // an overlong slash
}

TEST(Markup, ScriptDataCannotEndItsElement) {
  EXPECT_THAT(script_escaped("{\"a\":\"</script><!--\"}"), Not(HasSubstr("<")));
}

TEST(Markup, NumbersShowWhatTheStepNeeds) {
  EXPECT_EQ(number_text(0.25, 0.05), "0.25");
  EXPECT_EQ(number_text(-0.0, 0.1), "0.0");
  EXPECT_EQ(number_text(-3, 1),
            "\xE2\x88\x92"
            "3");
  EXPECT_EQ(number_text(std::nan(""), 1), "\xE2\x80\x93");
  EXPECT_EQ(significant_text(0.0123456, 3), "0.0123");
  EXPECT_EQ(significant_text(1234.6, 2), "1235");
}

TEST(AxisTicks, AreRoundAndCoverTheData) {
  const AxisTicks ticks = axis_ticks(0.03, 4.7, 5);
  EXPECT_DOUBLE_EQ(ticks.low, 0);
  EXPECT_DOUBLE_EQ(ticks.high, 5);
  EXPECT_THAT(ticks.values(), ElementsAre(0, 1, 2, 3, 4, 5));
}

TEST(AxisTicks, SurviveEveryRange) {
  const double infinity = std::numeric_limits<double>::infinity();
  for (const auto& [low, high] : {std::pair{0.0, 0.0},
                                  {5.0, 5.0},
                                  {-1e-300, 1e-300},
                                  {1e12, 1e12 + 1e-9},
                                  {infinity, -infinity},
                                  {std::nan(""), 1.0},
                                  {-1e300, 1e300}}) {
    const AxisTicks ticks = axis_ticks(low, high, 5);
    EXPECT_GT(ticks.high, ticks.low) << low << ' ' << high;
    EXPECT_LE(ticks.values().size(), 30U) << low << ' ' << high;
  }
}

TEST(Chart, SvgIsWellFormedXmlAndHoldsLegendUnitsAndTips) {
  const std::string svg = chart_svg_file(sample_chart());
  EXPECT_THAT(svg, IsWellFormedXml());
  EXPECT_THAT(svg, HasSubstr("error range (mm)"));
  EXPECT_THAT(svg, HasSubstr(">before</text>"));
  EXPECT_THAT(svg, HasSubstr("<title>before, x-tran: 4.20 mm</title>"));
  EXPECT_THAT(svg, Not(HasSubstr("<script")));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

TEST(Chart, ABarStandsOnZeroWithTheHeightOfItsValue) {
  Chart chart;
  Panel panel;
  panel.x.categories = {"a", "b"};
  panel.y.low = 0;
  panel.y.high = 4;
  panel.series = {{"s", Series::Kind::bars, Ink::series0, {}, {4, 1}, {}, {}, false}};
  chart.panels = {panel};
  const std::string svg = chart_inline_svg(chart);
  std::vector<double> heights;
  for (std::size_t at = svg.find("<g class=\"tip\">"); at != std::string::npos;
       at = svg.find("<g class=\"tip\">", at + 1)) {
    heights.push_back(std::stod(svg.substr(svg.find("height=\"", at) + 8)));
  }
  ASSERT_EQ(heights.size(), 2U);
  EXPECT_NEAR(heights[0] / heights[1], 4, 1e-3);
}

TEST(Chart, EmptyOrHopelessDataStillDraw) {
  Chart chart;
  EXPECT_THAT(chart_svg_file(chart), IsWellFormedXml());
  Panel panel;
  panel.series = {{"s",
                   Series::Kind::points,
                   Ink::series0,
                   {},
                   {std::nan(""), std::numeric_limits<double>::infinity()},
                   {},
                   {},
                   false}};
  panel.cells = {{{0, 0}, {1, 1}, std::nan(""), ""}};
  chart.panels = {panel};
  EXPECT_THAT(chart_svg_file(chart), AllOf(IsWellFormedXml(), Not(HasSubstr("nan")), Not(HasSubstr("inf"))));
}

TEST(Chart, PdfThatCannotBeDrawnIsNoFile) {
  PdfCanvas canvas({100, 100}, "title");
  TextStyle style;
  style.turn_deg = std::nan("");
  canvas.text({10, 10}, "words", style);
  EXPECT_THAT([&canvas] { (void)canvas.finish(); },
              ::testing::ThrowsMessage<std::runtime_error>(HasSubstr("cairo: invalid matrix")));
}

TEST(Chart, PdfIsThereAndSameInputGivesSameBytes) {
  const std::string pdf = chart_pdf_file(sample_chart());
  EXPECT_THAT(pdf, StartsWith("%PDF-"));
  EXPECT_THAT(pdf, HasSubstr("%%EOF"));
  EXPECT_EQ(pdf, chart_pdf_file(sample_chart()));
  EXPECT_EQ(chart_svg_file(sample_chart()), chart_svg_file(sample_chart()));
}

TEST(Chart, HeatColoursRiseInLightness) {
  double last = -1;
  for (int i = 0; i <= 20; ++i) {
    const std::uint32_t rgb = heat_rgb(i / 20.0);
    const double lightness =
        0.2126 * ((rgb >> 16U) & 255U) + 0.7152 * ((rgb >> 8U) & 255U) + 0.0722 * (rgb & 255U);
    EXPECT_GT(lightness, last);
    last = lightness;
  }
}

TEST(Scene3d, StillPictureIsWellFormedAndHoldsAllParts) {
  const std::string svg = scene_svg_file(sample_scene());
  EXPECT_THAT(svg, IsWellFormedXml());
  for (const char* part : {">UG<", ">LG<", ">DSC_0000<", "marker 103"}) EXPECT_THAT(svg, HasSubstr(part));
}

TEST(Scene3d, EllipsoidAxesAreTheSquareRootsOfTheVariances) {
  const Eigen::Matrix3d axes = ellipsoid_half_axes(Eigen::Vector3d(4, 9, 16).asDiagonal());
  EXPECT_NEAR((axes * axes.transpose() - Eigen::Matrix3d(Eigen::Vector3d(4, 9, 16).asDiagonal())).norm(), 0,
              1e-12);
}

}  // namespace
}  // namespace hexcal
