#include "core/haptics/thrust.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>

#include "core/base/random.h"

namespace spinaltap::haptics {
namespace {

TEST(Thrust, SettlesAtNewtonsPerMassRateWhateverTheStep) {
  for (const std::uint64_t step_us : {1ULL, 100ULL, 1000ULL, 20000ULL, 1000000ULL, 60000000ULL}) {
    Thrust thrust;
    const double mg_per_s = 2.0, step_s = static_cast<double>(step_us) * 1e-6;
    const auto steps = static_cast<std::uint64_t>(1.0 / step_s) + 50;  // fifty time constants
    for (std::uint64_t i = 0; i < steps; ++i) thrust.step(mg_per_s * step_s, step_us);
    // exp(-50) of the way is left, and a million roundings of 2e-16.
    EXPECT_NEAR(thrust.thrust_N(), kNewtonsPerMgPerS * mg_per_s, 1e-8) << step_us;
  }
}

TEST(Thrust, StaysBetweenNothingAndTheDrivingForceForAnySteps) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    Thrust thrust;
    for (int i = 0; i < 500; ++i) {
      const std::uint64_t step_us = random.bits() >> random.below(64);
      const double most_mg_per_s = 5.0;
      const double mg = random.unit() * most_mg_per_s * static_cast<double>(step_us) * 1e-6;
      const double force = thrust.step(mg, step_us);
      ASSERT_GE(force, 0);
      ASSERT_LE(force, kNewtonsPerMgPerS * most_mg_per_s * (1 + 1e-12));
    }
  }
}

TEST(Thrust, GivesOneImpulseForOneMassHoweverTheTimeIsCut) {
  // Summing the law over any steps: impulse = k * mass - tau * (last force - first force).
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    Random random(seed);
    Thrust thrust;
    double impulse_Ns = 0, mass_mg = 0;
    for (int i = 0; i < 300; ++i) {
      const double mg = random.unit();
      const std::uint64_t step_us = random.below(5000);  // 0 too: that mass waits
      const double force = thrust.step(mg, step_us);
      mass_mg += mg;
      impulse_Ns += force * static_cast<double>(step_us) * 1e-6;
    }
    const double last = thrust.step(0, 1);  // whatever waited
    impulse_Ns += last * 1e-6;
    EXPECT_NEAR(impulse_Ns, kNewtonsPerMgPerS * mass_mg - kSmoothing_s * last, 1e-10 * mass_mg) << seed;
  }
}

TEST(Thrust, CutsTheSameHoleToNearlyTheSameForceInOneMillisecondOrTen) {
  Thrust fine, coarse;
  for (int i = 0; i < 10; ++i) {
    for (int j = 0; j < 10; ++j) fine.step(0.002, 1000);
    coarse.step(0.02, 10000);
  }
  // Implicit Euler is of first order: after five time constants at most dt/tau of the remaining exp(-5) is between
  // them.
  EXPECT_NEAR(fine.thrust_N(), coarse.thrust_N(), 4.0 * 0.02);
}

TEST(Thrust, DecaysToExactlyNothingWithoutMass) {
  Thrust thrust;
  thrust.step(1.0, 1000);
  EXPECT_GT(thrust.thrust_N(), 1.0);
  double before = thrust.thrust_N();
  for (int i = 0; i < 2000 && before > 0; ++i) {
    const double now = thrust.step(0, 1000);
    EXPECT_LT(now, before);
    before = now;
  }
  EXPECT_EQ(thrust.thrust_N(), 0.0);
}

TEST(Thrust, KeepsTheMassOfACycleWithoutTimeForTheNext) {
  Thrust split, whole;
  EXPECT_EQ(split.step(0.5, 0), 0.0);
  EXPECT_EQ(split.step(0.25, 1000), whole.step(0.75, 1000));
}

TEST(Thrust, IsFiniteAfterTheLongestStepThereIs) {
  Thrust thrust;
  thrust.step(1, 1000);
  EXPECT_EQ(thrust.step(1, std::numeric_limits<std::uint64_t>::max()), 0.0);
  EXPECT_TRUE(std::isfinite(thrust.step(1, 1)));
}

}  // namespace
}  // namespace spinaltap::haptics
