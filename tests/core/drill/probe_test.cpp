#include "core/drill/probe.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "core/base/dmath.h"
#include "core/base/random.h"

namespace spinaltap::drill {
namespace {

using point_volume::Lattice;
using point_volume::PointVolume;

struct Tool {
  Vec3 x, y, z;
};
Tool randomTool(Random& random, double most_tilt_deg) {
  const SinCos tilt = sinCos(random.uniform(0, most_tilt_deg) * kPi / 180), at = sinCos(random.uniform(0, 2 * kPi));
  const Vec3 z{tilt.sin * at.cos, tilt.sin * at.sin, tilt.cos};
  const Vec3 x = normalized(cross(Vec3{0.3, 1, 0.2}, z));
  return {x, cross(z, x), z};
}

using Densities = std::array<std::uint16_t, Probe::kMostFacets>;

TEST(Probe, CoversTheBit) {
  for (const plan::Bit& bit :
       {plan::Bit{3, 5, 50}, plan::Bit{0.5, 0.2, 20}, plan::Bit{8, 0, 60}, plan::Bit{4, 30, 30}}) {
    const Probe probe({0.1, 60, 100, 0}, bit);
    double frontal = 0, tip_side = 0, shaft_side = 0, x = 0, y = 0;
    for (std::size_t i = 0; i < probe.count(); ++i) {
      const Facet facet = probe.facet(i);
      frontal += probe.areaOf(i).frontal_mm2;
      (i < Probe::kTipFacets ? tip_side : shaft_side) += probe.areaOf(i).side_mm2;
      EXPECT_NEAR(std::hypot(facet.out_x, facet.out_y), 1, 1e-6);  // singles
      x += facet.out_x, y += facet.out_y;
      // A spacing outside: along the normal that shaft and cone have there.
      const double behind = -facet.z_mm, across = facet.across_mm;
      const double r_ = bit.diameter_mm / 2, slope = std::hypot(r_, bit.cone_length_mm);
      const double off = i < Probe::kTipFacets ? (across * bit.cone_length_mm - behind * r_) / slope : across - r_;
      EXPECT_NEAR(off, 0.1, 1e-12) << i;
    }
    EXPECT_LT(std::hypot(x, y), 3) << "no direction is preferred";
    const double r = bit.diameter_mm / 2, shaft = bit.length_mm - bit.cone_length_mm;
    EXPECT_NEAR(frontal, kPi * r * r, 1e-9);
    EXPECT_NEAR(tip_side, kPi * r * bit.cone_length_mm, 1e-9);
    EXPECT_NEAR(shaft_side, 2 * kPi * r * shaft, 1e-9);
  }
}

TEST(Probe, FindsTheNearestPointAsALookAtAllOfThemDoes) {
  Random random(11);
  const Lattice lattice{0.5, 8, 12, -3};
  PointVolume volume = *point_volume::solidVolume(lattice, 1);
  const auto table = point_volume::discTable(lattice);
  for (std::uint32_t i = 0; i < lattice.points(); ++i) {
    volume.density_mg_cm3[i] = static_cast<std::uint16_t>(1 + i);
    if (random.below(3) == 0) volume.alive[i >> 6] &= ~(std::uint64_t{1} << (i & 63));
  }
  const plan::Bit bit{2, 1.5, 6};
  const Probe probe(lattice, bit);
  int met = 0, outside = 0;
  for (int n = 0; n < 60; ++n) {
    const Tool tool = randomTool(random, 180);
    const double x = random.uniform(-4, 4), y = random.uniform(-4, 4), z = random.uniform(-4, 8);
    const BitPose pose{{x, y, z}, tool.z};
    Densities densities{};
    probe.look(volume, pose, tool.x, tool.y, densities);
    for (std::size_t i = 0; i < probe.count(); ++i) {
      const Facet at = probe.facet(i);
      const Vec3 place =
          pose.tip_mm + tool.x * (at.out_x * at.across_mm) + tool.y * (at.out_y * at.across_mm) + tool.z * at.z_mm;
      // The cell that a place lies in: the disc, ring and slot of the nearest point in these three, one by one.
      double best = 1e300;
      std::uint32_t nearest = 0;
      const double radius = std::hypot(place.x, place.y);
      for (std::uint32_t p = 0; p < lattice.points(); ++p) {
        const point_volume::Site site = lattice.site(p);
        const std::size_t in_disc = p % lattice.pointsPerDisc();
        const double rings = std::abs(radius - 0.5 * site.ring),
                     discs = std::abs(place.z - lattice.discZ_mm(site.disc));
        const double apart = std::hypot(place.x - table.x_mm[in_disc], place.y - table.y_mm[in_disc]);
        const double far = rings * 1e6 + discs * 1e6 + apart;  // ring and disc first
        if (far < best) best = far, nearest = p;
      }
      const bool in_lattice =
          radius < 0.5 * 7.5 && place.z > lattice.discZ_mm(0) - 0.25 && place.z < lattice.discZ_mm(11) + 0.25;
      const std::uint16_t expected = in_lattice && volume.isAlive(nearest) ? volume.density_mg_cm3[nearest] : 0;
      ASSERT_EQ(densities[i], expected) << "pose " << n << " facet " << i;
      met += expected != 0, outside += !in_lattice;
    }
  }
  EXPECT_GT(met, 600);
  EXPECT_GT(outside, 600);
}

TEST(Probe, MeetsBoneAllRoundRightAfterTheBitHasCutThere) {
  // The claim of probe.h: in bone, no facet looks into the hole that the bit itself has just made.
  Random random(12);
  for (const double spacing : {0.5, 0.2, 0.1}) {
    for (int n = 0; n < 40; ++n) {
      plan::Bit bit{random.uniform(0.6, 3), 0, 5};
      bit.cone_length_mm = random.below(4) == 0 ? 0 : random.uniform(0.1, 4);
      const double wide = 9;
      const Lattice lattice{spacing, static_cast<int>(wide / spacing), static_cast<int>(2 * wide / spacing),
                            -static_cast<int>(wide / spacing)};
      PointVolume volume = *point_volume::solidVolume(lattice, 500);
      const Tool tool = randomTool(random, 180);
      const double x = random.uniform(-1, 1), y = random.uniform(-1, 1), z = random.uniform(-1, 1);
      const BitPose pose{{x, y, z}, tool.z};
      (void)(*makeEngine("bounded", volume, bit))->step(volume, pose);
      const Probe probe(lattice, bit);
      Densities densities{};
      probe.look(volume, pose, tool.x, tool.y, densities);
      for (std::size_t i = 0; i < probe.count(); ++i) ASSERT_EQ(densities[i], 500) << spacing << ", pose " << n;
    }
  }
}

TEST(MeetsAlive, SaysWhatALookAtEveryPointSays) {
  Random random(14);
  const Lattice lattice{0.25, 14, 40, -10};
  int met = 0, missed = 0, grazed = 0;
  for (int n = 0; n < 4000; ++n) {
    PointVolume volume = *point_volume::solidVolume(lattice, 500);
    // Mostly holes: a bit that meets something meets little of it.
    const std::uint64_t kept = random.below(3) == 0 ? 1 : 200;
    for (auto& alive : volume.alive) alive &= random.below(kept) == 0 ? random.bits() : 0;
    plan::Bit bit{random.uniform(0.5, 4), 0, random.uniform(4, 12)};
    bit.cone_length_mm = random.below(3) == 0 ? 0 : random.uniform(0.1, bit.length_mm);
    const Tool tool = randomTool(random, 180);
    const double x = random.uniform(-5, 5), y = random.uniform(-5, 5), z = random.uniform(-6, 12);
    const BitPose pose{{x, y, z}, tool.z};
    const BitShape shape = shapeOf(bit);
    std::uint64_t inside = 0;
    for (std::uint32_t p = 0; p < lattice.points(); ++p) {
      if (!volume.isAlive(p)) continue;
      inside += isInside(shape, pose.tip_mm, pose.axis, point_volume::positionOf(lattice, p)) ? 1 : 0;
    }
    ASSERT_EQ(meetsAlive(volume, shape, pose), inside > 0) << n << ": " << inside << " points inside";
    met += inside > 0, missed += inside == 0, grazed += inside == 1 || inside == 2;
  }
  EXPECT_GT(met, 500);
  EXPECT_GT(missed, 500);
  EXPECT_GT(grazed, 50);
}

TEST(Probe, SaysNoMoreThanIsTrueOfHowFarTheLatticeIs) {
  Random random(13);
  const Lattice lattice{0.2, 20, 50, -10};
  const plan::Bit bit{3, 4, 30};
  const PointVolume volume = *point_volume::solidVolume(lattice, 500);
  const Probe probe(lattice, bit);
  int clear = 0;
  for (int n = 0; n < 3000; ++n) {
    const Tool tool = randomTool(random, 180);
    const double x = random.uniform(-60, 60), y = random.uniform(-60, 60), z = random.uniform(-60, 60);
    const BitPose pose{{x, y, z}, tool.z};
    const double far = probe.clearOfLattice_mm(pose);
    if (!(far > 0)) continue;
    ++clear;
    // After any motion as long as that, still nothing is met.
    const Tool turned = randomTool(random, 180);
    const BitPose moved{pose.tip_mm - normalized(pose.tip_mm) * far, turned.z};
    Densities densities{};
    probe.look(volume, moved, turned.x, turned.y, densities);
    for (const std::uint16_t density : densities) ASSERT_EQ(density, 0) << n;
  }
  EXPECT_GT(clear, 500);
}

}  // namespace
}  // namespace spinaltap::drill
