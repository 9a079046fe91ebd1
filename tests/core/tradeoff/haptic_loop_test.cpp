#include "core/tradeoff/haptic_loop.h"

#include <gtest/gtest.h>

#include <utility>

namespace spinaltap::tradeoff {
namespace {

HapticCase shortCase(double seconds = 1.2) {
  HapticCase c;
  c.seconds = seconds;
  return c;
}

HapticResult run(const HapticCase& c) {
  const auto ideal = idealCourse(c);
  EXPECT_TRUE(ideal.has_value());
  const auto result = runLoop(c, *ideal);
  EXPECT_TRUE(result.has_value());
  return *result;
}

TEST(HapticLoop, AgreesWithItsReferenceWithoutANetworkAndTheBetterTheFaster) {
  HapticCase c = shortCase(2.5);
  c.holding = Holding::Tense;
  c.extrapolate = false;
  const Course ideal = *idealCourse(c);
  double before = 1e9;
  for (const double rate : {300.0, 1000.0, 4000.0}) {
    c.rate_hz = rate;
    const HapticResult result = *runLoop(c, ideal);
    EXPECT_LT(result.force_rms_N, before) << rate;
    EXPECT_LT(result.force_rms_N, 0.02 * result.force_mean_N) << rate;
    EXPECT_LE(result.given_mJ, 1e-9) << rate;
    EXPECT_EQ(result.lost + result.late, 0u);
    before = result.force_rms_N;
  }
}

TEST(HapticLoop, KeepsTheForceUnderDelayByWhatTheServerToldBefore) {
  for (const auto& [bone, holding] :
       {std::pair{Bone::ThroughTheWall, Holding::Relaxed}, {Bone::Cancellous, Holding::Tense}}) {
    HapticCase c = shortCase(2.5);
    c.bone = bone, c.holding = holding, c.delay_ms = 20;
    const Course ideal = *idealCourse(c);
    const HapticResult felt = *runLoop(c, ideal);
    c.extrapolate = false;
    const HapticResult raw = *runLoop(c, ideal);
    EXPECT_LT(felt.force_rms_N, 0.5 * raw.force_rms_N) << nameOf(bone) << " " << nameOf(holding);
    EXPECT_LE(felt.given_mJ, 1e-3) << nameOf(bone) << " " << nameOf(holding);
  }
}

TEST(HapticLoop, GoesOnThroughLossJitterAndMessagesThatOvertake) {
  HapticCase c = shortCase();
  c.holding = Holding::Trembling;
  c.delay_ms = 5, c.jitter_ms = 4, c.loss = 0.2;
  const HapticResult result = run(c);
  EXPECT_GT(result.lost, 200u);
  EXPECT_GT(result.late, 50u);
  c.delay_ms = c.jitter_ms = c.loss = 0;
  const HapticResult clean = run(c);
  EXPECT_NEAR(result.depth_mm, clean.depth_mm, 0.1);
  EXPECT_LT(result.force_rms_N, 0.2 * (1 + clean.force_mean_N));
}

TEST(HapticLoop, HoldsAWallAsStiffAsTheorySaysAndWithExtrapolationWhateverTheDelay) {
  // b > K T / 2 (Colgate and Schenkel): the relaxed hand's 0.003 N s/mm hold 6 N/mm at 1 kHz and 1.8 at 300 Hz. The
  // bisection is good to 5 %; what counts as swinging, and the hand's own spring, leave the rest.
  HapticCase c = shortCase();
  c.guard = false;
  c.extrapolate = false;
  const double alone = *stiffestStable_N_mm(c);
  EXPECT_GT(alone, 0.6 * 6);
  EXPECT_LT(alone, 1.3 * 6);
  c.rate_hz = 300;
  const double slow = *stiffestStable_N_mm(c);
  EXPECT_LT(slow, 0.5 * alone);
  c.rate_hz = 1000;
  c.delay_ms = 20;
  EXPECT_LT(*stiffestStable_N_mm(c), 0.1 * alone) << "a late force swings";
  c.extrapolate = true;
  EXPECT_GT(*stiffestStable_N_mm(c), 0.8 * alone) << "the local model does not";
  c.guard = true;
  EXPECT_GT(*stiffestStable_N_mm(c), 5 * alone) << "and the guard brakes what is too stiff";
}

TEST(HapticLoop, IsTheSameEveryTime) {
  HapticCase c = shortCase();
  c.delay_ms = 5, c.jitter_ms = 3, c.loss = 0.1;
  const HapticResult a = run(c), b = run(c);
  EXPECT_EQ(a.force_rms_N, b.force_rms_N);
  EXPECT_EQ(a.given_mJ, b.given_mJ);
  c.seed = 2;
  EXPECT_NE(run(c).lost, a.lost);
}

}  // namespace
}  // namespace spinaltap::tradeoff
