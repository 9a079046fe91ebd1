#include "core/tradeoff/drill_tradeoff.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "core/base/dmath.h"

namespace spinaltap::tradeoff {
namespace {

using drill::Precision;

DrillMeasured made(double spacing_mm, double p999_us, Precision precision = Precision::Double, int threads = 1) {
  DrillMeasured row;
  row.spacing_mm = spacing_mm, row.p999_s = p999_us * 1e-6, row.precision = precision, row.threads = threads;
  return row;
}

TEST(Recommendation, IsTheFinestSpacingThatHoldsTheRate) {
  const std::vector<DrillMeasured> rows{made(0.4, 10), made(0.1, 240), made(0.2, 100), made(0.05, 260)};
  EXPECT_EQ(recommended(rows, {1000, 4}), 1u) << "250 us";
  EXPECT_EQ(recommended(rows, {1000, 1}), 3u) << "1000 us";
  EXPECT_EQ(recommended(rows, {4000, 4}), 0u) << "62.5 us";
  EXPECT_EQ(recommended(rows, {500, 10}), 2u) << "200 us";
}

TEST(Recommendation, HoldsARateExactlyAtItsBudget) {
  const std::vector<DrillMeasured> rows{made(0.1, 250)};
  EXPECT_EQ(recommended(rows, {1e6 / 250, 1}), 0u);
}

TEST(Recommendation, IsNoneWhereNoneHolds) {
  EXPECT_EQ(recommended({}, {}), std::nullopt);
  const std::vector<DrillMeasured> rows{made(0.4, 251), made(0.1, std::numeric_limits<double>::quiet_NaN())};
  EXPECT_EQ(recommended(rows, {1000, 4}), std::nullopt);
}

TEST(Recommendation, TakesDoubleBeforeSingleAndOneThreadBeforeTwoAtOneSpacing) {
  std::vector<DrillMeasured> rows{made(0.1, 90, Precision::Single, 1), made(0.1, 80, Precision::Double, 2),
                                  made(0.1, 100, Precision::Double, 1), made(0.2, 1)};
  EXPECT_EQ(recommended(rows, {}), 2u);
  rows[2].p999_s = 1;
  EXPECT_EQ(recommended(rows, {}), 1u);
  rows[1].p999_s = 1;
  EXPECT_EQ(recommended(rows, {}), 0u);
  rows[0].p999_s = 1;
  EXPECT_EQ(recommended(rows, {}), 3u);
}

TEST(DrillScene, SweepsTheHoleThatItDrills) {
  const auto scene = drillScene(session::Scene::Off, 8);
  ASSERT_TRUE(scene.has_value()) << scene.error().message;
  ASSERT_EQ(scene->poses.size(), 801u);
  EXPECT_EQ(scene->steady, 500u);
  EXPECT_NEAR(scene->swept.total_mm3, kPi * 1.5 * 1.5 * (5.0 / 3 + 3), 5 * scene->swept.error_mm3);
  EXPECT_NEAR(scene->reach.radius_mm, 2.5, 1e-12);
  EXPECT_NEAR(scene->reach.depth_mm, 8, 1e-12);
  EXPECT_FALSE(drillScene(session::Scene::On, 5.5).has_value());
  EXPECT_FALSE(drillScene(session::Scene::On, std::nan("")).has_value());
}

TEST(DrillScene, StaysWithinItsLatticesCells) {
  DrillScene scene;
  scene.reach = {3.3, 8};
  for (const double spacing : {0.4, 0.2, 0.1, 0.05, 0.025}) {
    const auto lattice = drillLattice(scene, spacing);
    // a cell reaches half a spacing around its point; the scene begins at the first disc's upper face
    EXPECT_GE((lattice.rings - 0.5) * spacing, 3.3);
    EXPECT_LT((lattice.rings - 1.5) * spacing, 3.3);
    EXPECT_GE((lattice.discs - 0.5) * spacing, 8);
    EXPECT_EQ(lattice.first_disc, 0);
  }
  scene.reach.radius_mm = 1.5;
  EXPECT_EQ(drillLattice(scene, 0.1).rings, session::reportLattice().rings);
}

/// One lattice of 0.4 mm, coarse and quick.
class Measured : public testing::Test {
 protected:
  static std::vector<DrillMeasured> rows(const DrillRunOptions& options, double spacing_mm = 0.4) {
    static const auto scene = drillScene(session::Scene::Hand, 8, {.columns = 300});
    auto measured = measureDrill(*scene, spacing_mm, options);
    EXPECT_TRUE(measured.has_value()) << measured.error().message;
    return measured ? *measured : std::vector<DrillMeasured>();
  }
};

TEST_F(Measured, RowsComeByPrecisionAndThreadsAndRemoveTheSameInDouble) {
  int builds = 0;
  DrillRunOptions options;
  options.repeats = 1;
  options.build = [&](const point_volume::Lattice&, int threads) {
    ++builds;
    return Result<double>(threads * 0.5);
  };
  const auto all = rows(options);
  ASSERT_EQ(all.size(), 4u);
  EXPECT_EQ(builds, 2) << "single precision is built no other way";
  for (std::size_t n = 0; n < 4; ++n) {
    EXPECT_EQ(all[n].precision, n < 2 ? Precision::Double : Precision::Single);
    EXPECT_EQ(all[n].threads, n % 2 == 0 ? 1 : 2);
    EXPECT_EQ(all[n].build_s, 0.5 * all[n].threads);
    EXPECT_EQ(all[n].median_s, 0) << "no clock";
    EXPECT_GT(all[n].bytes, all[n].points * 2) << "two bytes of density a point, and alive bits";
  }
  EXPECT_EQ(all[1].differing, 0u) << "threads change nothing";
  EXPECT_EQ(all[1].removed, all[0].removed);
  EXPECT_EQ(all[3].removed, all[2].removed);
}

TEST_F(Measured, TimesAreTheFastestOfTheRepeatsByTheClockGiven) {
  // Every call of the clock is a millisecond on, and in the first run each cycle takes a second more.
  double now = 0;
  int calls = 0;
  const int cycles = 8001;
  DrillRunOptions options;
  options.precisions = {Precision::Double}, options.threads = {1}, options.repeats = 2;
  options.clock = [&] {
    now += 1e-3;
    if (++calls <= 2 * cycles) now += 1;
    return now;
  };
  const auto one = rows(options);
  ASSERT_EQ(one.size(), 1u);
  ASSERT_EQ(calls, 4 * cycles);
  EXPECT_NEAR(one[0].median_s, 1e-3, 1e-9);
  EXPECT_NEAR(one[0].p999_s, 1e-3, 1e-9);
  EXPECT_NEAR(one[0].met_p999_s, 1.001, 1e-9);
}

TEST_F(Measured, ErrorsAndRippleShrinkWithTheSpacing) {
  DrillRunOptions options;
  options.precisions = {Precision::Double}, options.threads = {1}, options.repeats = 1;
  const auto coarse = rows(options, 0.4), fine = rows(options, 0.1);
  ASSERT_EQ(coarse.size() + fine.size(), 2u);
  // 64 times the points, met as unevenly as at random: an eighth of the ripple
  EXPECT_NEAR(std::log2(coarse[0].ripple / fine[0].ripple), 3, 0.7);
  EXPECT_LT(fine[0].ripple_smoothed, 0.5 * fine[0].ripple);
  // The hole's wall is met to some part of a cell: 0.4 mm of a radius of 1.5 mm and more, on both sides.
  EXPECT_LT(std::abs(coarse[0].removed_error), 0.1);
  EXPECT_LT(std::abs(fine[0].removed_error), 0.01);
  EXPECT_LT(std::abs(fine[0].cycle_error), 0.02);
}

TEST_F(Measured, AnEngineThatIsNotThereIsNamed) {
  const auto scene = drillScene(session::Scene::On, 6, {.columns = 50});
  DrillRunOptions options;
  options.engine = "steam";
  const auto measured = measureDrill(*scene, 0.4, options);
  ASSERT_FALSE(measured.has_value());
  EXPECT_NE(measured.error().message.find("steam"), std::string::npos);
  EXPECT_FALSE(measureDrill(*scene, 0.0001, options).has_value()) << "more points than an index counts";
}

}  // namespace
}  // namespace spinaltap::tradeoff
