#include "core/tradeoff/lattice_study.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "core/base/dmath.h"
#include "core/base/random.h"
#include "core/drill/predicate.h"

namespace spinaltap::tradeoff {
namespace {

using point_volume::Lattice;
using point_volume::Site;

TEST(LatticeStudy, AlignedIsTheLatticeThatIsDrilled) {
  const Lattice lattice{0.1, 20, 3, -1};
  const auto table = point_volume::discTable(lattice);
  for (std::uint32_t i = 0; i < lattice.points(); ++i) {
    const Vec3 p = positionOf(lattice, lattice.site(i), Phase::Aligned);
    const std::uint32_t rest = i % lattice.pointsPerDisc();
    // two ways of taking sines, each good to 4.5e-16, of angles rounded to 2 pi * 2^-53; radii below 2 mm
    ASSERT_NEAR(p.x, table.x_mm[rest], 5e-15);
    ASSERT_NEAR(p.y, table.y_mm[rest], 5e-15);
    ASSERT_EQ(p.z, lattice.discZ_mm(lattice.site(i).disc));
  }
}

TEST(LatticeStudy, TurnsKeepRadiiAndGapsAndJitterStaysInItsCell) {
  const Lattice lattice{0.2, 9, 5, 0};
  for (const Phase phase : kPhases) {
    const bool jitter = phase == Phase::JitterQuarter || phase == Phase::JitterHalf;
    const double most = phase == Phase::JitterHalf ? 0.1 : phase == Phase::JitterQuarter ? 0.05 : 0.0;
    double moved = 0;
    for (std::uint32_t i = 0; i < lattice.points(); ++i) {
      const Site site = lattice.site(i);
      const Vec3 p = positionOf(lattice, site, phase);
      EXPECT_EQ(p, positionOf(lattice, site, phase));
      const double z = std::abs(p.z - lattice.discZ_mm(site.disc));
      ASSERT_LE(z, phase == Phase::Screw ? 0.1 + 1e-15 : most);
      moved = std::max(moved, z);
      if (jitter) {
        const Vec3 d = p - positionOf(lattice, site, Phase::Aligned);
        ASSERT_LE(d.x * d.x + d.y * d.y, 2 * most * most * (1 + 1e-12));
        continue;
      }
      ASSERT_NEAR(std::hypot(p.x, p.y), 0.2 * site.ring, 1e-14);
      if (site.ring == 0) continue;
      const int slots = Lattice::slotsOf(site.ring);
      const Vec3 next = positionOf(lattice, {site.disc, site.ring, (site.slot + 1) % slots}, phase);
      ASSERT_NEAR(std::hypot(next.x - p.x, next.y - p.y), 2 * 0.2 * site.ring * std::sin(kPi / slots), 1e-14);
    }
    if (jitter) {
      EXPECT_GT(moved, 0.95 * most);  // 1085 draws: all below that with odds of 1e-24
    }
  }
}

Neighbours bruteNeighbours(const Lattice& lattice, Phase phase) {
  const auto points = positionsOf(lattice, phase);
  std::vector<double> found[3];
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const Site a = lattice.site(i);
    if (a.ring < 1 || a.ring + 1 >= lattice.rings || a.disc < 1 || a.disc + 1 >= lattice.discs) continue;
    double least[3];
    std::fill(least, least + 3, std::numeric_limits<double>::infinity());
    for (std::uint32_t j = 0; j < points.size(); ++j) {
      const Site b = lattice.site(j);
      const double distance = norm(points[i] - points[j]) / lattice.spacing_mm;
      if (i != j && a.disc == b.disc && a.ring == b.ring) least[0] = std::min(least[0], distance);
      if (a.disc == b.disc && std::abs(a.ring - b.ring) == 1) least[1] = std::min(least[1], distance);
      if (std::abs(a.disc - b.disc) == 1) least[2] = std::min(least[2], distance);
    }
    for (int kind = 0; kind < 3; ++kind) found[kind].push_back(least[kind]);
  }
  const auto spread = [](const std::vector<double>& v) {
    return Spread{*std::min_element(v.begin(), v.end()),
                  std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size()),
                  *std::max_element(v.begin(), v.end())};
  };
  return {spread(found[0]), spread(found[1]), spread(found[2])};
}

void expectNear(const Spread& a, const Spread& b) {
  EXPECT_NEAR(a.least, b.least, 1e-12);
  EXPECT_NEAR(a.mean, b.mean, 1e-12);
  EXPECT_NEAR(a.most, b.most, 1e-12);
}

TEST(LatticeStudy, FindsTheNeighboursThatLookingAtAllPairsFinds) {
  for (const Lattice& lattice : {Lattice{0.1, 3, 3, 0}, Lattice{0.3, 8, 4, -2}}) {
    for (const Phase phase : kPhases) {
      SCOPED_TRACE(nameOf(phase));
      const Neighbours quick = neighboursOf(lattice, phase), slow = bruteNeighbours(lattice, phase);
      expectNear(quick.in_ring, slow.in_ring);
      expectNear(quick.across_rings, slow.across_rings);
      expectNear(quick.across_discs, slow.across_discs);
    }
  }
}

TEST(LatticeStudy, FindsTheDensityThatCountingAllPointsFinds) {
  const Lattice lattice{0.25, 8, 14, 3};
  const double radius = 0.6;
  for (const Phase phase : kPhases) {
    const auto points = positionsOf(lattice, phase);
    Random random(77);
    std::vector<double> shares;
    while (shares.size() < 200) {
      const double wide = 7 * 0.25 - radius;
      const double x = random.uniform(-wide, wide), y = random.uniform(-wide, wide);
      const double z = random.uniform(lattice.discZ_mm(0) + radius, lattice.discZ_mm(13) - radius);
      if (x * x + y * y > wide * wide) continue;
      int inside = 0;
      for (const Vec3& p : points) inside += dot(p - Vec3{x, y, z}, p - Vec3{x, y, z}) <= radius * radius ? 1 : 0;
      shares.push_back(inside * point_volume::pointVolume_mm3(lattice) / (4 * kPi / 3 * radius * radius * radius));
    }
    const double mean = std::accumulate(shares.begin(), shares.end(), 0.0) / 200;
    double squares = 0;
    for (const double s : shares) squares += (s - mean) * (s - mean);
    const Share found = densityOf(lattice, phase, radius, 200, 77);
    EXPECT_NEAR(found.mean, mean, 1e-12);
    EXPECT_NEAR(found.deviation, std::sqrt(squares / 200) / mean, 1e-12);
    EXPECT_NEAR(found.mean, 1, 0.1);  // points are shared out right, whatever the phase
  }
}

/// A motion of either kind, anywhere.
Motion randomMotion(Random& random, bool sideways) {
  Motion motion;
  motion.axis = normalized({random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), 1});
  motion.tip_mm = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 4)};
  const Vec3 beside = normalized(cross(motion.axis, {random.gaussian(), random.gaussian(), random.gaussian()}));
  motion.step_mm = (sideways ? beside : motion.axis) * random.uniform(0.003, 0.1);
  motion.cycles = 1 + static_cast<int>(random.below(40));
  return motion;
}

TEST(LatticeStudy, CountsWhatTestingEveryPointInEveryCycleRemoves) {
  std::uint64_t in_all = 0;
  for (std::uint64_t seed = 1; seed <= 240; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const Lattice lattice{random.uniform(0.15, 0.3), 3 + static_cast<int>(random.below(6)), 12, 0};
    const plan::Bit bit{random.uniform(0.5, 3), seed % 5 == 0 ? 0.0 : random.uniform(0.1, 3), random.uniform(3, 9)};
    const Motion motion = randomMotion(random, seed % 2 == 0);
    auto points = positionsOf(lattice, kPhases[seed % kPhases.size()]);
    const drill::BitShape shape = drill::shapeOf(bit);
    const auto removed = removedPerCycle(points, bit, motion);
    for (int cycle = 0; cycle <= motion.cycles; ++cycle) {
      const std::size_t before = points.size();
      std::erase_if(points, [&](const Vec3& p) {
        return drill::isInside(shape, motion.tip_mm + motion.step_mm * cycle, motion.axis, p);
      });
      if (cycle == 0) continue;
      ASSERT_EQ(removed[static_cast<std::size_t>(cycle) - 1], before - points.size()) << "cycle " << cycle;
      in_all += before - points.size();
    }
  }
  EXPECT_GT(in_all, 10'000u);
}

TEST(LatticeStudy, SweepsTheVolumeThatAFineLatticeCounts) {
  // 1 mm in one step: the points' grain is 0.05 mm on a front of some 10 mm^2, with an error of some parts in a
  // thousand.
  const Lattice lattice{0.05, 72, 160, 0};
  const auto points = positionsOf(lattice, Phase::JitterHalf);
  for (const NamedMotion& named : usualMotions(0.1)) {
    const auto removed = removedPerCycle(points, named.bit, named.motion);
    const double counted =
        std::accumulate(removed.begin(), removed.end(), 0.0) * point_volume::pointVolume_mm3(lattice);
    EXPECT_NEAR(counted / (sweptPerCycle_mm3(named.bit, named.motion) * named.motion.cycles), 1, 0.009) << named.name;
  }
}

TEST(LatticeStudy, RippleIsThatOfTheCounts) {
  const Lattice lattice{0.2, 18, 40, 0};
  const NamedMotion named = usualMotions(0.1).back();
  const auto points = positionsOf(lattice, Phase::Staggered);
  const double each_mm3 = point_volume::pointVolume_mm3(lattice);
  const auto removed = removedPerCycle(points, named.bit, named.motion);
  ASSERT_EQ(removed.size(), 10u);
  double mean = 0, squares = 0;
  for (const auto n : removed) mean += n / 10.0;
  for (const auto n : removed) squares += (n - mean) * (n - mean) / 10;
  const Share ripple = rippleOf(points, each_mm3, named.bit, named.motion);
  EXPECT_NEAR(ripple.deviation, std::sqrt(squares) / mean, 1e-12);
  EXPECT_NEAR(ripple.mean, mean * each_mm3 / sweptPerCycle_mm3(named.bit, named.motion), 1e-12);
}

TEST(LatticeStudy, SmoothingTakesRippleOutAndLeavesTheMean) {
  const Lattice lattice = motionLattice();
  const auto points = positionsOf(lattice, Phase::JitterHalf);
  const NamedMotion named = usualMotions(0.002)[0];
  const double each_mm3 = point_volume::pointVolume_mm3(lattice);
  const Share raw = rippleOf(points, each_mm3, named.bit, named.motion);
  const Share smooth = rippleOf(points, each_mm3, named.bit, named.motion, 20);
  // One pole of T cycles leaves 1 / sqrt(2 T + 1) = 0.16 of white noise's deviation.
  EXPECT_NEAR(smooth.deviation / raw.deviation, 0.16, 0.08);
  EXPECT_NEAR(smooth.mean, raw.mean, 0.03);
}

}  // namespace
}  // namespace spinaltap::tradeoff
