#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "tests/report/sample_charts.h"
#include "tests/report/well_formed.h"
#include "tests/support/temporary_folder.h"
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

// Loads the page in the browser with a script that sorts a table, turns the view and reports by the title.
TEST(Page, WorksInAHeadlessBrowserWithoutConsoleErrors) {
  if (std::system("command -v chromium >/dev/null 2>&1") != 0) GTEST_SKIP() << "chromium is not installed";
  const TemporaryFolder folder;
  std::string page = render_page(sample_page());
  const std::string probe = R"(<script>
    const header = document.querySelectorAll("table.sortable th button")[1];
    header.click();
    const first = document.querySelector("table.sortable tbody tr").cells[0].textContent;
    header.click();
    const last = document.querySelector("table.sortable tbody tr:last-child").cells[0].textContent;
    const sort = header.parentElement.getAttribute("aria-sort");
    const scene = document.getElementById("scene");
    const shown = scene.dataset.ready === "true" || !document.getElementById("scene-note").hidden;
    if (scene.dataset.ready) document.getElementById("scene-left").click();
    document.body.dataset.probe = [first, last, sort, shown, document.querySelectorAll("svg.chart").length].join(" ");
    </script></body>)";
  page.replace(page.find("</body>"), 7, probe);
  const std::string file = (folder.path() / "page.html").string();
  std::ofstream(file) << page;
  const std::string command =
      "timeout 100 chromium --headless --no-sandbox --disable-quic --no-first-run "
      "--disable-background-networking "
      "--disable-component-update --disable-sync --use-gl=angle --use-angle=swiftshader "
      "--enable-unsafe-swiftshader "
      "--enable-logging=stderr --virtual-time-budget=3000 --user-data-dir='" +
      (folder.path() / "profile").string() + "' --dump-dom 'file://" + file + "' >'" +
      (folder.path() / "dom").string() + "' 2>'" + (folder.path() / "log").string() + "'";
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_THAT(contents(folder.path() / "dom"), HasSubstr("data-probe=\"a c descending true 2\""));
  EXPECT_THAT(contents(folder.path() / "log"), Not(HasSubstr("CONSOLE")));
}

}  // namespace
}  // namespace hexcal
