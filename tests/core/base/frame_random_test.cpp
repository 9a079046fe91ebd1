#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "core/base/frame.h"
#include "core/base/hash.h"
#include "core/base/random.h"

namespace spinaltap {
namespace {

Frame randomFrame(Random& random, double reach_mm) {
  const auto inBox = [&] { return Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)}; };
  const Vec3 z = normalized(inBox());
  const Vec3 x = normalized(cross(inBox(), z));
  return {inBox() * reach_mm, {x, cross(z, x), z}};
}

TEST(Frame, GoesThereAndBackWithinRoundingEvenAKilometreAway) {
  Random random(1);
  for (int i = 0; i < 2000; ++i) {
    const double reach_mm = std::pow(10.0, random.uniform(0, 6));
    const Frame frame = randomFrame(random, reach_mm);
    const Vec3 local{random.uniform(-50, 50), random.uniform(-50, 50), random.uniform(-50, 50)};
    const Vec3 back = frame.toLocal(frame.toPatient(local));
    // The patient coordinate is rounded to half a unit in the last place of its size, once an axis; the axes are
    // orthonormal to a few units of 1.
    const double bound = 16 * std::numeric_limits<double>::epsilon() * (reach_mm + 100);
    EXPECT_LE(norm(back - local), bound) << "reach " << reach_mm;
  }
}

TEST(Random, GivesOneSequenceForOneSeed) {
  Random random(42);
  // SplitMix64's published first outputs for seed 1234567 (Steele et al. 2014 and its many ports).
  Random known(1234567);
  EXPECT_EQ(known.bits(), 6457827717110365317ULL);
  EXPECT_EQ(known.bits(), 3203168211198807973ULL);
  std::set<std::uint64_t> seen;
  for (int i = 0; i < 10000; ++i) seen.insert(random.bits());
  EXPECT_EQ(seen.size(), 10000u);
}

TEST(Random, GaussianHasMeanZeroAndDeviationOneAndStaysWithinSix) {
  Random random(7);
  double sum = 0, squares = 0;
  constexpr int kDraws = 200000;
  for (int i = 0; i < kDraws; ++i) {
    const double value = random.gaussian();
    ASSERT_LE(std::abs(value), 6.0);
    sum += value;
    squares += value * value;
  }
  // Five standard errors: 1/sqrt(N) for the mean, sqrt(2/N) for the variance.
  EXPECT_NEAR(sum / kDraws, 0, 5 / std::sqrt(kDraws));
  EXPECT_NEAR(squares / kDraws, 1, 5 * std::sqrt(2.0 / kDraws));
}

TEST(Mix64, TurnsEveryFlippedBitIntoAboutHalfOfAllBits) {
  Random random(3);
  for (int bit = 0; bit < 64; ++bit) {
    int flipped = 0;
    for (int i = 0; i < 200; ++i) {
      const std::uint64_t value = random.bits();
      flipped += __builtin_popcountll(mix64(value) ^ mix64(value ^ (1ULL << bit)));
    }
    EXPECT_NEAR(flipped / 200.0, 32, 5 * 4 / std::sqrt(200.0)) << "bit " << bit;  // binomial: deviation 4 a draw
  }
}

TEST(BitsOf, CountsMinusZeroAsZeroAndTellsNeighboursApart) {
  EXPECT_EQ(bitsOf(-0.0), bitsOf(0.0));
  EXPECT_NE(bitsOf(1.0), bitsOf(std::nextafter(1.0, 2.0)));
  EXPECT_EQ(bitsOf(1.0), 0x3ff0000000000000ULL);
}

}  // namespace
}  // namespace spinaltap
