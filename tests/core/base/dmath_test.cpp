#include "core/base/dmath.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/random.h"

namespace spinaltap {
namespace {

TEST(SinCos, IsWithinTwoUnitsInTheLastPlaceOfOneUpToAMillionRadians) {
  Random random(20020401);
  for (int i = 0; i < 200000; ++i) {
    const double scale = std::ldexp(1.0, static_cast<int>(random.below(50)) - 30);
    const double x = random.uniform(-1, 1) * std::min(scale, 1e6);
    const SinCos ours = sinCos(x);
    const auto exact = static_cast<long double>(x);
    ASSERT_NEAR(ours.sin, static_cast<double>(std::sin(exact)), 4.5e-16) << "x = " << x;
    ASSERT_NEAR(ours.cos, static_cast<double>(std::cos(exact)), 4.5e-16) << "x = " << x;
  }
}

TEST(SinCosOfTurn, IsExactAtQuartersAndMirroredInEveryOctant) {
  for (const int denominator : {6, 12, 174, 234, 1200}) {
    for (int n = 0; n < denominator; ++n) {
      const SinCos a = sinCosOfTurn(n, denominator);
      const SinCos mirrored = sinCosOfTurn((denominator - n) % denominator, denominator);
      EXPECT_EQ(a.cos, mirrored.cos);
      EXPECT_EQ(a.sin, -mirrored.sin);
      const SinCos opposite = sinCosOfTurn((n + denominator / 2) % denominator, denominator);
      EXPECT_EQ(a.cos, -opposite.cos);
      EXPECT_EQ(a.sin, -opposite.sin);
      const long double turn = 2 * std::acos(-1.0L) * n / denominator;
      EXPECT_NEAR(a.sin, static_cast<double>(std::sin(turn)), 4.5e-16);
      EXPECT_NEAR(a.cos, static_cast<double>(std::cos(turn)), 4.5e-16);
    }
    EXPECT_EQ(sinCosOfTurn(0, denominator).sin, 0.0);
    EXPECT_EQ(sinCosOfTurn(denominator / 2, denominator).cos, -1.0);
  }
}

}  // namespace
}  // namespace spinaltap
