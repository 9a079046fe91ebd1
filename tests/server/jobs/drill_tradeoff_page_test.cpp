// The page of the drill's trade-off, from made-up figures: a file that parses, holds every row, and needs nothing else.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <vector>

#include "server/jobs/drill_tradeoff_job.h"
#include "server/jobs/drill_tradeoff_page.h"
#include "tests/server/jobs/elements.h"

namespace spinaltap::jobs {
namespace {

using test::elementsOf;

Figures made(bool holds) {
  Figures figures{{"scene", "hand"},
                  {"length_mm", 12},
                  {"cycles", 12001},
                  {"steady_cycles", 7001},
                  {"repeats", 3},
                  {"processor", "A <fast> & \"quiet\" one"},
                  {"hardware_threads", 2},
                  {"rate_hz", 1000.0},
                  {"headroom", 4.0},
                  {"budget_us", 250.0},
                  {"swept_mm3", 79.1},
                  {"swept_error_percent", 0.004},
                  {"swept_cycle_mm3", 0.007},
                  {"swept_cycle_error_percent", 2.0},
                  {"centres", 4000},
                  {"sums_s", 0.1},
                  {"rows", Figures::array()},
                  {"recommendation", "Take <this> & that."}};
  for (const double spacing : {0.4, 0.1}) {
    for (const char* precision : {"double", "single"}) {
      for (const int threads : {1, 2}) {
        const bool single = precision[0] == 's';
        figures["rows"].push_back({{"spacing_mm", spacing},
                                   {"precision", precision},
                                   {"threads", threads},
                                   {"points", 1000},
                                   {"memory_mb", 0.01 / spacing},
                                   {"bytes_per_point", 2.2},
                                   {"build_s", 0.01},
                                   {"median_us", (single ? 1.5 : 1.0) / spacing},
                                   {"p999_us", (single ? 6.0 : 5.0) / spacing},
                                   {"met_p999_us", 90.0},
                                   {"cycles_per_s", 1234567.0},
                                   {"cycles_per_s_p999", 43210.0},
                                   {"median_ratio", 1.0},
                                   {"p999_ratio", 1.0},
                                   {"removed", 4711},
                                   {"removed_mm3", 79.2},
                                   {"removed_error_percent", 0.13},
                                   {"cycle_error_percent", -0.02},
                                   {"ripple_percent", 40.0},
                                   {"ripple_smoothed_percent", 0.0},
                                   {"differing", single ? 17 : 0},
                                   {"differing_on", single ? 160 : 0}});
      }
    }
  }
  if (holds) figures["recommended_row"] = 4;
  return figures;
}

TEST(DrillTradeoffPage, IsWellFormedAndNeedsNothingElse) {
  for (const bool holds : {true, false}) {
    const std::string page = drillTradeoffPage(made(holds));
    const auto names = elementsOf(page);
    EXPECT_EQ(names.count("svg"), 6U);
    test::expectNeedsNothingElse(page, names);
    EXPECT_NE(page.find("Take &lt;this&gt; &amp; that."), std::string::npos);
    EXPECT_NE(page.find("A &lt;fast&gt; &amp; &quot;quiet&quot; one"), std::string::npos);
    EXPECT_EQ(page.find("class=\"best\"") != std::string::npos, holds);
  }
}

TEST(DrillTradeoffPage, HoldsEveryRowAndNamesItsCharts) {
  const Figures figures = made(true);
  const std::string page = drillTradeoffPage(figures);
  for (const Figures& row : figures["rows"]) {
    std::string cells;
    for (const TableColumn& column : drillColumns().subspan(1)) cells += "<td>" + cellOf(row, column) + "</td>";
    EXPECT_NE(page.find(cells), std::string::npos) << cells;
  }
  const std::regex chart("<svg [^>]*role=\"img\" aria-label=\"[^\"]{20,}\"");
  EXPECT_EQ(std::distance(std::sregex_iterator(page.begin(), page.end(), chart), std::sregex_iterator()), 6);
  EXPECT_NE(page.find("tabindex=\"0\""), std::string::npos) << "a wide table scrolls by keyboard";
  for (const char* spacing : {"0.4", "0.1"}) {
    EXPECT_NE(page.find(std::string(">") + spacing + "</text>"), std::string::npos) << "a tick at what was measured";
  }
  EXPECT_EQ(page.find("nan"), std::string::npos) << "the ripple that is 0 has no logarithm, and is left out";
  EXPECT_NE(page.find("<td>1</td><td>1.5</td><td>1.2</td><td>17</td><td>160</td><td>4711</td>"), std::string::npos)
      << "single over double: 1.5 times the median, 1.2 times the p99.9";
}

TEST(DrillTradeoffPage, DrawsTheSameLinesInWhateverOrderSpacingsWereAskedFor) {
  Figures figures = made(false), turned = made(false);
  for (Figures* some : {&figures, &turned}) {
    for (const double spacing : {0.2, 0.05}) {
      Figures row = (*some)["rows"].front();
      row["spacing_mm"] = spacing, row["median_us"] = 1 / spacing;
      (*some)["rows"].push_back(row);
    }
  }
  std::reverse(turned["rows"].begin(), turned["rows"].end());
  const auto lines = [](const Figures& of) {
    const std::string page = drillTradeoffPage(of);
    const std::regex polyline("<polyline[^>]*points=\"[^\"]*\"");
    std::multiset<std::string> found;
    for (std::sregex_iterator at(page.begin(), page.end(), polyline), end; at != end; ++at) found.insert(at->str());
    return found;
  };
  EXPECT_GT(lines(figures).size(), 10U);
  EXPECT_EQ(lines(figures), lines(turned));
}

TEST(DrillTradeoffTable, HasALineARowAndTheRecommendation) {
  const Figures figures = made(true);
  const std::string table = drillTradeoffTable(figures);
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 1 + 8 + 1 + 1 + 1);
  EXPECT_NE(table.find("+0.13"), std::string::npos) << "errors have their sign";
  EXPECT_NE(table.find("1230000"), std::string::npos) << "three digits, no exponents";
  EXPECT_NE(table.find("Take <this> & that.\n"), std::string::npos);
}

TEST(DrillTradeoff, RefusesWhatItCannotMeasureBeforeItRuns) {
  DrillTradeoffJob job;
  job.length_mm = 3;
  EXPECT_FALSE(drillTradeoff(job, {}).has_value());
  job = {}, job.spacings_mm = {};
  EXPECT_FALSE(drillTradeoff(job, {}).has_value());
  job = {}, job.spacings_mm = {0.1, 0.0001};
  EXPECT_FALSE(drillTradeoff(job, {}).has_value());
  job = {}, job.scene = session::Scene::On, job.length_mm = 37.8, job.spacings_mm = {0.1, 0.01};
  const auto large = drillTradeoff(job, {});
  ASSERT_FALSE(large.has_value());
  EXPECT_EQ(large.error().code, ErrorCode::Limit);
  job = {}, job.html = "no/such/folder/page.html";
  const auto nowhere = drillTradeoff(job, {});
  ASSERT_FALSE(nowhere.has_value());
  EXPECT_EQ(nowhere.error().message, "trade-off: cannot write no/such/folder/page.html: there is no such folder");
  job.html = ".";
  EXPECT_FALSE(drillTradeoff(job, {}).has_value()) << "a folder";
  EXPECT_NE(large.error().message.find("spacing 0.01 mm"), std::string::npos) << large.error().message;
}

}  // namespace
}  // namespace spinaltap::jobs
