// The grid of closed loops: the same figures from any number of threads, each row what its case alone gives.
#include "core/tradeoff/haptic_tradeoff.h"

#include <gtest/gtest.h>

#include <limits>

namespace spinaltap::tradeoff {
namespace {

HapticGrid small() {
  HapticGrid grid;
  grid.rates_hz = {300};
  grid.delays_ms = {5};
  grid.jitter_ms = 4, grid.loss = 0.1;
  grid.seconds = 0.5;
  return grid;
}

TEST(HapticGrid, GivesWhatEachCaseGivesAloneWhateverTheThreads) {
  HapticGrid grid = small();
  grid.threads = 1;
  const auto one = measureHaptics(grid);
  grid.threads = 3;
  const auto three = measureHaptics(grid);
  ASSERT_TRUE(one.has_value() && three.has_value());
  ASSERT_EQ(one->size(), 3u * 4 * 2 * 2) << "bones, hands, networks, ways";
  ASSERT_EQ(three->size(), one->size());
  for (std::size_t n = 0; n < one->size(); ++n) {
    EXPECT_EQ((*one)[n].result.force_rms_N, (*three)[n].result.force_rms_N) << n;
    EXPECT_EQ((*one)[n].result.given_mJ, (*three)[n].result.given_mJ) << n;
    EXPECT_EQ((*one)[n].result.lost, (*three)[n].result.lost) << n;
    EXPECT_EQ((*one)[n].setting.bone, static_cast<Bone>(n / 16)) << n;
    EXPECT_EQ((*one)[n].setting.extrapolate, n % 2 == 1) << n;
    EXPECT_EQ((*one)[n].result.lost > 0, n % 4 >= 2) << "the rough network is the last";
  }
  const HapticMeasured& row = (*one)[27];
  const auto ideal = idealCourse(row.setting);
  ASSERT_TRUE(ideal.has_value());
  const auto alone = runLoop(row.setting, *ideal);
  ASSERT_TRUE(alone.has_value());
  EXPECT_EQ(alone->force_rms_N, row.result.force_rms_N);
  EXPECT_EQ(row.errorShare(), alone->force_rms_N / alone->force_mean_N);
}

TEST(HapticGrid, PutsTheRoughNetworkAtTheMiddleDelayUnlessItIsNotWanted) {
  HapticGrid grid;
  grid.delays_ms = {50, 1, 0, 20, 5};
  const auto networks = networksOf(grid);
  ASSERT_EQ(networks.size(), 6u);
  EXPECT_EQ(networks[0].delay_ms, 0);
  EXPECT_EQ(networks[4].delay_ms, 50);
  EXPECT_EQ(networks[5].delay_ms, 5);
  EXPECT_EQ(networks[5].jitter_ms, 4);
  EXPECT_EQ(networks[5].loss, 0.05);
  grid.jitter_ms = grid.loss = 0;
  EXPECT_EQ(networksOf(grid).size(), 5u);
}

TEST(HapticGrid, ShowsForceAMillisecondBesideTheIdeal) {
  HapticCase c;
  c.seconds = 0.5, c.holding = Holding::Leaning;
  const auto courses = forceCourses(c);
  ASSERT_TRUE(courses.has_value());
  ASSERT_EQ(courses->answered.t_s.size(), 500u);
  ASSERT_EQ(courses->ideal_N.size(), 500u);
  const auto ideal = idealCourse(c);
  EXPECT_EQ(courses->ideal_N[400], -ideal->force_N[8000]);
  EXPECT_DOUBLE_EQ(courses->answered.t_s[400], 0.4);
  EXPECT_NE(courses->answered.force_N, courses->extrapolated.force_N);
}

TEST(HapticGrid, RefusesWhatItCannotMeasure) {
  const auto refused = [](const auto& change) {
    HapticGrid grid = small();
    change(grid);
    return !checkGrid(grid).has_value() && !measureHaptics(grid).has_value() && !measureStiffest(grid).has_value();
  };
  EXPECT_TRUE(checkGrid(small()).has_value());
  EXPECT_TRUE(checkGrid({}).has_value());
  EXPECT_TRUE(refused([](HapticGrid& g) { g.rates_hz = {}; }));
  EXPECT_TRUE(refused([](HapticGrid& g) { g.rates_hz = {49}; }));
  EXPECT_TRUE(refused([](HapticGrid& g) { g.rates_hz = {300, 300}; }));
  EXPECT_TRUE(refused([](HapticGrid& g) { g.rates_hz = {50, 60, 70, 80, 90, 100, 110}; }));
  EXPECT_TRUE(refused([](HapticGrid& g) { g.delays_ms = {-1}; }));
  EXPECT_TRUE(refused([](HapticGrid& g) { g.delays_ms = {std::numeric_limits<double>::quiet_NaN()}; }));
  EXPECT_TRUE(refused([](HapticGrid& g) { g.loss = 1; }));
  EXPECT_TRUE(refused([](HapticGrid& g) { g.jitter_ms = -1; }));
  EXPECT_TRUE(refused([](HapticGrid& g) { g.seconds = 0; }));
}

}  // namespace
}  // namespace spinaltap::tradeoff
