#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "tests/report/sample_report.h"
#include "tests/support/temporary_folder.h"
#include "tools/report/comparison_page.h"

namespace hexcal {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// What the browser made of a page after a script at its end ran.
struct Browsed {
  std::string dom, log;
};

class InABrowser : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::system("command -v chromium >/dev/null 2>&1") != 0) GTEST_SKIP() << "chromium is not installed";
  }

  // The script's result is read from the attribute data-probe of the body.
  static Browsed browse(std::string page, const std::string& script) {
    const TemporaryFolder folder;
    page.replace(page.find("</body>"), 7, "<script>" + script + "</script></body>");
    const std::string file = (folder.path() / "page.html").string();
    std::ofstream(file) << page;
    const std::string command =
        "timeout 100 chromium --headless --no-sandbox --disable-quic --no-first-run "
        "--disable-background-networking --disable-component-update --disable-sync --use-gl=angle "
        "--use-angle=swiftshader --enable-unsafe-swiftshader --enable-logging=stderr "
        "--virtual-time-budget=3000 --user-data-dir='" +
        (folder.path() / "profile").string() + "' --dump-dom 'file://" + file + "' >'" +
        (folder.path() / "dom").string() + "' 2>'" + (folder.path() / "log").string() + "'";
    EXPECT_EQ(std::system(command.c_str()), 0);
    return {contents(folder.path() / "dom"), contents(folder.path() / "log")};
  }
};

TEST_F(InABrowser, TheCampaignsPageSortsTurnsAndLoadsNothing) {
  const Browsed browsed = browse(render_page(campaign_page(sample_report())), R"(
    const table = document.querySelector("#poses table.sortable");
    const header = [...table.tHead.rows[0].cells].findIndex((cell) => cell.textContent.startsWith("x"));
    const button = table.tHead.rows[0].cells[header].querySelector("button");
    const values = () => [...table.tBodies[0].rows].map((row) => row.cells[header].dataset.v).filter(Boolean).map(Number);
    const rises = (list) => list.every((value, i) => i === 0 || list[i - 1] <= value);
    button.click();
    const up = rises(values());
    button.click();
    const down = rises(values().reverse());
    const scene = document.getElementById("scene");
    const shown = scene.dataset.ready === "true" || !document.getElementById("scene-note").hidden;
    if (scene.dataset.ready) {
      document.getElementById("scene-left").click();
      scene.querySelector("canvas").dispatchEvent(new KeyboardEvent("keydown", {key: "ArrowLeft"}));
    }
    const missing = ["verdict", "poses", "methods", "machine", "view", "network", "photographs", "provenance"]
      .filter((id) => !document.getElementById(id));
    document.body.dataset.probe = [up, down, table.querySelector("[aria-sort]").getAttribute("aria-sort"), shown,
      missing.length, document.querySelectorAll(".photographs svg image").length,
      document.querySelectorAll("svg .tip title").length > 50,
      performance.getEntriesByType("resource").length].join(" ");)");
  EXPECT_THAT(browsed.dom, HasSubstr("data-probe=\"true true descending true 0 2 true 0\""));
  EXPECT_THAT(browsed.log, Not(HasSubstr("CONSOLE")));
}

TEST_F(InABrowser, TheComparisonHoldsItsTablesAndFigures) {
  const ComparisonReport report{sample_report(), sample_report()};
  const Browsed browsed = browse(render_page(comparison_page(report)), R"(
    const words = [...document.querySelectorAll("main h2")].map((title) => title.textContent);
    document.body.dataset.probe = [words.includes("Before and after"), document.querySelectorAll("svg.chart").length > 1,
      performance.getEntriesByType("resource").length].join(" ");)");
  EXPECT_THAT(browsed.dom, HasSubstr("data-probe=\"true true 0\""));
  EXPECT_THAT(browsed.log, Not(HasSubstr("CONSOLE")));
}

}  // namespace
}  // namespace hexcal
