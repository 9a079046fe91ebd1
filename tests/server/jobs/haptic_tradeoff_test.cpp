// What rate and delay do to a hand, as figures, table and page: from a small grid, all of it.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "server/jobs/haptic_tradeoff_job.h"
#include "server/jobs/haptic_tradeoff_page.h"
#include "tests/server/jobs/elements.h"

namespace spinaltap::jobs {
namespace {

HapticTradeoffJob small() {
  HapticTradeoffJob job;
  job.grid.rates_hz = {300}, job.grid.delays_ms = {20}, job.grid.jitter_ms = 0, job.grid.loss = 0;
  job.grid.seconds = 0.5;
  return job;
}

TEST(HapticTradeoff, TellsOfEveryCaseInTableAndPage) {
  double before = 0;
  const auto figures = hapticTradeoff(small(), [&](std::string_view, double done) {
    EXPECT_GE(done, before);
    EXPECT_LE(done, 1);
    before = done;
  });
  ASSERT_TRUE(figures.has_value());
  const std::string page = hapticTradeoffPage(*figures), table = hapticTradeoffTable(*figures);
  const auto names = test::elementsOf(page);
  EXPECT_EQ(names.count("svg"), 3U + 2 + 1) << "bones, guards, force over time";
  test::expectNeedsNothingElse(page, names);
  EXPECT_EQ(page.find("nan"), std::string::npos);
  ASSERT_EQ((*figures)["rows"].size(), 24U);
  for (const Figures& row : (*figures)["rows"]) {
    std::string cells;
    for (const TableColumn& column : hapticColumns().subspan(1)) cells += "<td>" + cellOf(row, column) + "</td>";
    EXPECT_NE(page.find(cells), std::string::npos) << cells;
  }
  EXPECT_EQ((*figures)["follows"].size(), 3U);
  for (const Figures& text : (*figures)["follows"]) {
    EXPECT_NE(table.find(text.get<std::string>()), std::string::npos);
    EXPECT_NE(page.find(plots::escaped(text.get<std::string>())), std::string::npos);
  }
}

TEST(HapticTradeoff, NamesTheCasesThatMadeEnergyAndSaysWhichRatesAskForASofterCoupling) {
  const auto figures = hapticTradeoff(small(), {});
  ASSERT_TRUE(figures.has_value());
  const std::string stiffness = (*figures)["follows"][1], energy = (*figures)["follows"][2];
  EXPECT_NE(stiffness.find("a relaxed one with 1.35 at 300 Hz."), std::string::npos) << stiffness;
  double most = 0;
  for (const Figures& row : (*figures)["rows"]) {
    if (row["way"] == "as answered") most = std::max(most, row["given_mJ"].get<double>());
  }
  ASSERT_GT(most, 1) << "20 ms late, held too stiff";
  EXPECT_NE(energy.find(" " + plots::shortNumber(most)), std::string::npos) << energy;
}

TEST(HapticTradeoff, RefusesWhatItCannotMeasureBeforeItRuns) {
  HapticTradeoffJob job = small();
  job.html = "no/such/folder/page.html";
  const auto nowhere = hapticTradeoff(job, {});
  ASSERT_FALSE(nowhere.has_value());
  EXPECT_EQ(nowhere.error().message, "trade-off: cannot write no/such/folder/page.html: there is no such folder");
  job = small(), job.grid.rates_hz = {300, 300};
  const auto twice = hapticTradeoff(job, {});
  ASSERT_FALSE(twice.has_value());
  EXPECT_EQ(twice.error().message, "trade-off: the same rate twice");
}

}  // namespace
}  // namespace spinaltap::jobs
