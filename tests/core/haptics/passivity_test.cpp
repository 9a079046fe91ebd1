#include "core/haptics/passivity.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/haptics/hand.h"

namespace spinaltap::haptics {
namespace {

TEST(PassivityGuard, CountsExactlyWhatAHeldForceGives) {
  PassivityGuard guard(0);
  Vec3 at, force{1, -2, 0.5};
  double given = 0;
  (void)guard.step(at, force, 0.001);
  for (int i = 1; i < 100; ++i) {
    const Vec3 next{0.01 * i, 0.02 * std::sin(0.1 * i), -0.005 * i};
    given += dot(force, next - at);
    at = next, force = {std::cos(0.2 * i), 0.3, -1};
    EXPECT_EQ(guard.step(at, force, 0.001), force) << "without a brake it only watches";
    EXPECT_NEAR(guard.given_mJ(), given, 1e-12);
  }
}

/// A hand on a spring that is sampled and held: stable alone only while b > K T / 2.
double swingAfter(double stiffness, double brake, double* given) {
  const double period = 0.001, tick = 5e-5;
  Hand hand({0.15, 0.003, 0});
  hand.place({0, 0, 1});
  PassivityGuard guard(brake);
  Vec3 force;
  double most = 0;
  for (int i = 0; i < 40000; ++i) {
    if (i % 20 == 0) force = guard.step(hand.at_mm(), hand.at_mm() * -stiffness, period);
    hand.step({}, {}, force, tick);
    if (i > 30000) most = std::max(most, std::abs(hand.at_mm().z));
  }
  *given = guard.mostGiven_mJ();
  return most;
}

TEST(PassivityGuard, StopsASpringThatSwingsByItself) {
  // K T / 2 = 0.003 at 6 N/mm and 1 ms: a little less comes to rest by itself, four times that does not.
  double given = 0;
  // 0.003 - 4 * 0.001 / 2 N s/mm are left, 1 N s/m; on 0.15 kg the swing falls by exp(-3.3) a second.
  EXPECT_LT(swingAfter(4, 0, &given), 2 * 0.0067);
  EXPECT_GT(swingAfter(24, 0, &given), 1) << "without the guard the swing grows";
  EXPECT_GT(given, 10);
  const double started = 0.5 * 24;  // mJ in the spring when the hand lets go of it
  EXPECT_LT(swingAfter(24, 0.5 * 0.15 / 1000 / 0.001, &given), 0.05);
  EXPECT_LT(given, started * 1.2)
      << "no more comes out than was in the spring, and what a period may give before it is seen";
}

}  // namespace
}  // namespace spinaltap::haptics
