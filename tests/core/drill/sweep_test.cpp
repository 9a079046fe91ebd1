#include "core/drill/sweep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/dmath.h"
#include "core/base/random.h"

namespace spinaltap::drill {
namespace {

using point_volume::Lattice;
using point_volume::PointVolume;

const plan::Bit kBit{1.0, 1.0, 6.0};
const Lattice kLattice{0.1, 20, 100, 0};

Vec3 direction(Random& random) {
  const SinCos tilt = sinCos(random.uniform(0, kPi)), azimuth = sinCos(random.uniform(0, 2 * kPi));
  return {tilt.sin * azimuth.cos, tilt.sin * azimuth.sin, tilt.cos};
}

std::vector<BitPose> cuts(Sweep& sweep) {
  std::vector<BitPose> all;
  while (const auto pose = sweep.next()) all.push_back(*pose);
  return all;
}

TEST(Sweep, CutsAtAPoseAsItIsWhenTheBitHardlyMoved) {
  Sweep sweep(kLattice, kBit);
  for (int i = 0; i < 50; ++i) {
    const BitPose pose{{0.001 * i, 0, 0.02 * i}, normalized({1e-5 * i, 0, 1})};
    ASSERT_TRUE(sweep.add(pose, true));
    const std::vector<BitPose> all = cuts(sweep);
    ASSERT_EQ(all.size(), 1u);
    EXPECT_EQ(all[0].tip_mm, pose.tip_mm);
    EXPECT_EQ(all[0].axis, pose.axis);
  }
}

/// How deep a point is inside the bit: at most that far from its surface.
double depth(const plan::Bit& bit, const BitPose& pose, const Vec3& point) {
  const Vec3 from_tip = point - pose.tip_mm;
  const double along = -dot(from_tip, pose.axis), radial = norm(from_tip + pose.axis * along);
  const double slope = bit.diameter_mm / 2 / bit.cone_length_mm;
  return std::min({along, bit.length_mm - along, bit.diameter_mm / 2 - radial,
                   (along * slope - radial) / std::sqrt(1 + slope * slope)});
}

TEST(Sweep, LeavesNothingStandingThatTheBitWentThroughDeeperThanItSays) {
  // The truth: the motion in 2001 poses, each of which moves the bit by less than a hundredth of a spacing.
  constexpr double kSpacing = 0.25;
  int gone = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const Lattice lattice{kSpacing, 9, 24, -6};
    PointVolume volume = *point_volume::solidVolume(lattice, 300);
    const auto engine = *makeEngine("clearance", volume, kBit);
    BitPose from{{random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 6)}, direction(random)};
    BitPose to{{random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 6)}, direction(random)};
    if (seed % 3 == 0) to.axis = from.axis;  // only thrown
    if (seed % 3 == 1) to.axis = normalized(from.axis + direction(random) * 0.5);
    if (dot(from.axis, to.axis) < -0.9) to.axis = -to.axis;  // the truth below turns along the chord
    Sweep sweep(lattice, kBit);
    ASSERT_TRUE(sweep.add(from, true) && sweep.add(to, true));
    for (const BitPose& pose : cuts(sweep)) engine->step(volume, pose);
    const point_volume::DiscTable table = point_volume::discTable(lattice);
    std::vector<double> deepest(lattice.points(), -1e9);
    for (int i = 0; i <= 2000; ++i) {
      const double part = i / 2000.0;
      const BitPose pose{from.tip_mm + (to.tip_mm - from.tip_mm) * part,
                         normalized(from.axis + (to.axis - from.axis) * part)};
      for (std::uint32_t p = 0; p < lattice.points(); ++p) {
        const std::uint32_t in_disc = p % lattice.pointsPerDisc();
        const Vec3 point{table.x_mm[in_disc], table.y_mm[in_disc],
                         lattice.discZ_mm(static_cast<int>(p / lattice.pointsPerDisc()))};
        if (norm(point - pose.tip_mm) < 6.1) deepest[p] = std::max(deepest[p], depth(kBit, pose, point));
      }
    }
    for (std::uint32_t p = 0; p < lattice.points(); ++p) {
      gone += !volume.isAlive(p);
      if (deepest[p] > Sweep::kSurvival * kSpacing) {
        ASSERT_FALSE(volume.isAlive(p)) << "point " << p << " was " << deepest[p] << " mm inside";
      }
      if (deepest[p] < -0.01 * kSpacing) {
        ASSERT_TRUE(volume.isAlive(p)) << "point " << p << " was never inside";
      }
    }
  }
  EXPECT_GT(gone, 1000);
}

TEST(Sweep, MovesNoPointOfTheBitFartherThanItSaysAndArrives) {
  Random random(77);
  for (int i = 0; i < 300; ++i) {
    const plan::Bit bit{random.uniform(0.5, 8), random.uniform(0, 1), random.uniform(1, 60)};
    const double spacing = random.uniform(0.02, 0.5);
    BitPose from{direction(random) * random.uniform(0, 10), direction(random)};
    BitPose to{from.tip_mm + direction(random) * random.uniform(0, 5), direction(random)};
    if (i % 5 == 0) to.axis = -from.axis;
    if (i % 5 == 1) to.axis = normalized(direction(random) * 1e-4 - from.axis);
    // A lattice that the bit can touch wherever it is.
    const int wide = static_cast<int>(20 / spacing);
    Sweep sweep({spacing, wide, 2 * wide, -wide}, bit);
    ASSERT_TRUE(sweep.add(from, true) && sweep.add(to, true));
    const std::vector<BitPose> all = cuts(sweep);
    ASSERT_EQ(all.back().tip_mm, to.tip_mm);
    ASSERT_EQ(all.back().axis, to.axis);
    ASSERT_LT(all.size(), 1000000u);
    for (std::size_t k = 1; k < all.size(); ++k) {
      ASSERT_NEAR(norm(all[k].axis), 1.0, 1e-12);
      for (const double along : {0.0, bit.length_mm}) {
        const auto place = [&](const BitPose& pose) { return pose.tip_mm - pose.axis * along; };
        ASSERT_LE(norm(place(all[k]) - place(all[k - 1])), 2 * Sweep::kSurvival * spacing * (1 + 1e-12));
      }
    }
  }
}

TEST(Sweep, DoesNotCutBetweenPosesOfWhichOneDidNotTurn) {
  Sweep sweep(kLattice, kBit);
  ASSERT_TRUE(sweep.add({{0, 0, 0}, {0, 0, 1}}, false));
  EXPECT_TRUE(cuts(sweep).empty());
  ASSERT_TRUE(sweep.add({{0, 0, 5}, {0, 0, 1}}, true));
  EXPECT_EQ(cuts(sweep).size(), 1u);
  ASSERT_TRUE(sweep.add({{0, 0, 0}, {0, 0, 1}}, false));
  EXPECT_TRUE(cuts(sweep).empty());
  ASSERT_TRUE(sweep.add({{0, 0, 1}, {0, 0, 1}}, true));
  EXPECT_EQ(cuts(sweep).size(), 1u);
  ASSERT_TRUE(sweep.add({{0, 0, 2}, {0, 0, 1}}, true));
  EXPECT_EQ(cuts(sweep).size(), 20u);
}

TEST(Sweep, CutsNothingWhereTheBitIsTooFarAwayToTouch) {
  Sweep sweep(kLattice, kBit);
  ASSERT_TRUE(sweep.add({{1e6, 0, 0}, {0, 0, 1}}, true) && sweep.add({{-1e6, 0, 0}, {0, 0, 1}}, true));
  std::vector<BitPose> all = cuts(sweep);
  // 2 (sqrt(5^2 + 2^2) + 6) mm of the way, in steps of 0.05.
  EXPECT_GT(all.size(), 400u);
  EXPECT_LT(all.size(), 480u);
  ASSERT_TRUE(sweep.add({{-1e6, 1e6, 0}, {0, 0, -1}}, true));
  EXPECT_EQ(cuts(sweep).size(), 1u);
}

TEST(Sweep, HoldsSoManyPosesAndLosesNone) {
  Sweep sweep(kLattice, kBit);
  for (std::size_t i = 0; i < Sweep::kMostPoses; ++i)
    ASSERT_TRUE(sweep.add({{0, 0, 0.01 * double(i)}, {0, 0, 1}}, true));
  EXPECT_FALSE(sweep.add({{0, 0, 9}, {0, 0, 1}}, true));
  EXPECT_FALSE(sweep.done());
  const std::vector<BitPose> all = cuts(sweep);
  ASSERT_EQ(all.size(), Sweep::kMostPoses);
  for (std::size_t i = 0; i < all.size(); ++i) EXPECT_EQ(all[i].tip_mm.z, 0.01 * double(i));
  EXPECT_TRUE(sweep.done());
}

}  // namespace
}  // namespace spinaltap::drill
