#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/report/sample_charts.h"
#include "tests/report/well_formed.h"
#include "tools/report/html_page.h"
#include "tools/report/page_resources.h"

namespace hexcal {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

HtmlTable sample_table() {
  HtmlTable table;
  table.caption = "Poses";
  table.columns = {{"pose", "", false, ""}, {"x", "mm", true, "position"}, {"status", "", false, ""}};
  table.rows = {{{"b", {}, Light::good, "", ""}, number_cell(10, 3), {"ok", {}, Light::good, "", ""}},
                {{"a", {}, Light::bad, "", ""},
                 number_cell(-9, 3),
                 {"=1+1 <img src=x onerror=alert(1)>", {}, Light::bad, "", ""}},
                {{"c", {}, Light::warning, "", ""},
                 number_cell(std::nan(""), 3),
                 {"too few markers", {}, Light::warning, "", ""}}};
  return table;
}

HtmlPage sample_page() {
  HtmlPage page;
  page.title = "Report of </title><script>alert(1)</script>";
  page.with_scene = true;
  page.verdict =
      html_verdict({Light::warning, "Errors fall.", {"pose `b` & <c>"}, {"Run `hexcal measure X`"}});
  page.sections = {{"poses", "Poses", html_table(sample_table())},
                   {"figures", "Figures", html_figure(sample_chart())},
                   {"view", "3D view", html_scene(sample_scene())}};
  return page;
}

TEST(Page, TableIsWellFormedSortableAndEscaped) {
  const std::string table = html_table(sample_table()).source;
  EXPECT_THAT(table, IsWellFormedXml());
  EXPECT_THAT(table, HasSubstr("class=\"sortable\""));
  EXPECT_THAT(table, HasSubstr("data-v=\"-9\""));
  EXPECT_THAT(table, HasSubstr("&lt;img src=x"));
  EXPECT_THAT(table, Not(HasSubstr("<img")));
}

TEST(Page, VerdictSaysItsLightInWords) {
  const std::string verdict = html_verdict({Light::bad, "h", {"pose `b` & <c>"}, {}}).source;
  EXPECT_THAT(verdict, HasSubstr("Not usable"));
  EXPECT_THAT(verdict, HasSubstr("<code>b</code> &amp; &lt;c&gt;"));
  EXPECT_THAT(verdict, IsWellFormedXml());
  EXPECT_THAT(html_verdict({Light::none, "h", {}, {}}).source, HasSubstr("Not judged"));
}

TEST(Page, NeedsNoNetworkAndStaysSmall) {
  const std::string page = render_page(sample_page());
  EXPECT_THAT(page, HasSubstr("default-src 'none'"));
  EXPECT_LT(page.size(), 5'000'000U);
  EXPECT_THAT(page, Not(HasSubstr("<script src")));
  EXPECT_THAT(page, Not(HasSubstr("</title><script>alert")));
  EXPECT_THAT(page, HasSubstr("Permission is hereby granted"));  // the licence of three.js goes with it
}

TEST(Page, EveryInkOfTheChartsHasItsColourInThePage) {
  const std::string style(resource(Resource::style));
  for (int i = 0; i < static_cast<int>(Ink::exact); ++i) {
    const std::string name(ink_name(static_cast<Ink>(i)));
    EXPECT_THAT(style, HasSubstr(".f-" + name + " { fill: var(--" + name + "); }"));
    EXPECT_THAT(style, HasSubstr(".k-" + name + " { stroke: var(--" + name + "); }"));
  }
}

}  // namespace
}  // namespace hexcal
