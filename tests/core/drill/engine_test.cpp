#include "core/drill/engine.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/dmath.h"
#include "core/base/random.h"
#include "core/drill/predicate.h"

namespace spinaltap::drill {
namespace {

using point_volume::Lattice;
using point_volume::PointVolume;

plan::Bit randomBit(Random& random) {
  plan::Bit bit;
  bit.diameter_mm = random.uniform(0.5, 8);
  if (random.below(4) == 0) bit.diameter_mm = 0.1 * static_cast<double>(5 + random.below(70));  // grazes rings
  bit.length_mm = random.uniform(1, 60);
  bit.cone_length_mm = random.below(4) == 0 ? 0.0 : random.uniform(0, bit.length_mm);
  return bit;
}

Lattice randomLattice(Random& random) {
  static constexpr double kSpacings[] = {0.5, 0.25, 0.2, 0.1, 0.05};
  Lattice lattice;
  lattice.spacing_mm = kSpacings[random.below(5)];
  lattice.rings = 1 + static_cast<int>(random.below(45));
  const std::uint64_t most = 1 + 80000 / lattice.pointsPerDisc();
  lattice.discs = 1 + static_cast<int>(random.below(std::min<std::uint64_t>(most, 200)));
  lattice.first_disc = static_cast<int>(random.below(40)) - 20;
  return lattice;
}

Vec3 direction(double tilt_rad, double azimuth_rad) {
  const SinCos tilt = sinCos(tilt_rad), azimuth = sinCos(azimuth_rad);
  return {tilt.sin * azimuth.cos, tilt.sin * azimuth.sin, tilt.cos};
}

/// Anything a hand may do, and what it may not: upright on a lattice point, backwards, flat, outside.
BitPose randomPose(Random& random, const Lattice& lattice) {
  const double wide = lattice.rings * lattice.spacing_mm, z0 = lattice.discZ_mm(0);
  const double z1 = lattice.discZ_mm(lattice.discs - 1);
  BitPose pose;
  pose.tip_mm = {random.uniform(-wide, wide), random.uniform(-wide, wide), random.uniform(z0 - 1, z1 + 5)};
  static constexpr double kTilts[] = {0, 2, 10, 45, 89, 90, 91, 178, 180};
  const double tilt_deg = kTilts[random.below(9)] + (random.below(2) == 0 ? 0.0 : random.uniform(-1, 1));
  pose.axis = direction(tilt_deg * kPi / 180, random.uniform(0, 2 * kPi));
  if (random.below(5) == 0) pose = {{0, 0, lattice.discZ_mm(static_cast<int>(random.below(80)))}, {0, 0, 1}};
  if (random.below(12) == 0) pose.tip_mm += direction(random.uniform(0, kPi), random.uniform(0, 6)) * 1000.0;
  return pose;
}

void moveOn(Random& random, BitPose& pose) {
  const double step = std::ldexp(1.0, -static_cast<int>(random.below(20)));
  pose.tip_mm += direction(random.uniform(0, kPi), random.uniform(0, 6)) * step;
  pose.axis = normalized(pose.axis + direction(random.uniform(0, kPi), random.uniform(0, 6)) * (0.1 * step));
}

void expectSame(const Removal& a, const Removal& b) {
  ASSERT_EQ(a.count, b.count);
  ASSERT_EQ(a.density_sum_mg_cm3, b.density_sum_mg_cm3);
  ASSERT_EQ(a.hash_delta, b.hash_delta);
  ASSERT_TRUE(std::equal(a.indices.begin(), a.indices.end(), b.indices.begin(), b.indices.end()));
}

TEST(Bounded, RemovesWhatTheReferenceRemovesForAnyBitLatticeAndMotion) {
  std::uint64_t removed = 0, cycles = 0, tested = 0;
  for (std::uint64_t seed = 1; seed <= 600; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const plan::Bit bit = randomBit(random);
    PointVolume a = *point_volume::solidVolume(randomLattice(random), 300);
    for (auto& density : a.density_mg_cm3) density = static_cast<std::uint16_t>(random.below(65536));
    PointVolume b = a;
    const auto reference = *makeEngine("reference", a, bit);
    const auto bounded = *makeEngine("bounded", b, bit);
    BitPose pose = randomPose(random, a.lattice);
    for (int i = 0; i < 12; ++i, ++cycles) {
      if (random.below(3) == 0) {
        pose = randomPose(random, a.lattice);
      } else {
        moveOn(random, pose);
      }
      const Removal truth = reference->step(a, pose), ours = bounded->step(b, pose);
      expectSame(ours, truth);
      ASSERT_EQ(a.alive, b.alive);
      removed += truth.count, tested += ours.tested;
    }
  }
  // The cases are worth something only if they cut.
  EXPECT_GT(removed, 1000000u);
  RecordProperty("cycles", static_cast<int>(cycles));
}

}  // namespace
}  // namespace spinaltap::drill
