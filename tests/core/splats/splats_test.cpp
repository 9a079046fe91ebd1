#include "core/splats/splats.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "core/base/random.h"
#include "core/session/session.h"
#include "core/splats/normals.h"

namespace spinaltap::splats {
namespace {

using point_volume::Lattice;
using point_volume::PointVolume;
using point_volume::Site;

PointVolume solid(const Lattice& lattice) { return point_volume::solidVolume(lattice, 300).value(); }

void kill(PointVolume& volume, std::uint32_t index) { volume.alive[index >> 6] &= ~(1ull << (index & 63)); }

std::set<std::uint32_t> neighboursOf(const Neighbours& neighbours, std::uint32_t index) {
  std::set<std::uint32_t> found;
  neighbours.forEach(index,
                     [&](std::uint32_t other) { EXPECT_TRUE(found.insert(other).second) << "twice: " << other; });
  return found;
}

std::set<std::uint32_t> indicesOf(const std::vector<Splat>& splats) {
  std::set<std::uint32_t> indices;
  for (const Splat& s : splats) indices.insert(s.index);
  EXPECT_EQ(indices.size(), splats.size()) << "a point twice";
  return indices;
}

TEST(Neighbours, AreMutualAndEightInsideTheLattice) {
  const Lattice lattice{0.1, 7, 3, 0};
  const Neighbours neighbours(lattice);
  for (std::uint32_t index = 0; index < lattice.points(); ++index) {
    const auto found = neighboursOf(neighbours, index);
    EXPECT_FALSE(found.count(index));
    for (const std::uint32_t other : found) {
      ASSERT_LT(other, lattice.points());
      EXPECT_TRUE(neighboursOf(neighbours, other).count(index)) << index << " and " << other;
    }
    const Site site = lattice.site(index);
    if (site.ring < lattice.rings - 1 && site.disc == 1) {
      EXPECT_EQ(found.size(), 8u) << index;
    }
  }
}

TEST(Neighbours, OnTheNextRingAreTheSlotsOnEitherSide) {
  const Lattice lattice{0.1, 30, 1, 0};
  const Neighbours neighbours(lattice);
  for (int ring = 2; ring + 1 < lattice.rings; ++ring) {
    for (int slot = 0; slot < 6 * ring; ++slot) {
      const auto found = neighboursOf(neighbours, lattice.index({0, ring, slot}));
      for (const int other : {ring - 1, ring + 1}) {  // slots at most one apart in angle from slot * other / ring
        const int below = slot * other / ring, above = (slot * other + ring - 1) / ring;
        EXPECT_TRUE(found.count(lattice.index({0, other, below % (6 * other)}))) << ring << " " << slot;
        EXPECT_TRUE(found.count(lattice.index({0, other, above % (6 * other)}))) << ring << " " << slot;
      }
    }
  }
}

TEST(Splats, ALatticeOfLivePointsExposesNothingAtItsOwnEnds) {
  EXPECT_TRUE(scan(solid({0.1, 6, 5, -1}), solid({0.1, 6, 5, -1})).empty());
}

TEST(Splats, OneRemovedPointExposesItsEightNeighbours) {
  PointVolume volume = solid({0.1, 6, 5, 0});
  const PointVolume before = volume;
  const std::uint32_t index = volume.lattice.index({2, 3, 4});
  kill(volume, index);
  const auto splats = scan(volume, before);
  EXPECT_EQ(indicesOf(splats), neighboursOf(Neighbours(volume.lattice), index));
  for (const Splat& s : splats) EXPECT_EQ(s.kind, Kind::CutWall);
}

/// Drops what is hidden and adds what is exposed, as a client does.
class Client {
 public:
  void take(SplatTracker& tracker, const PointVolume& volume) {
    for (const Splat& s : tracker.takeExposed(volume)) {
      ASSERT_TRUE(drawn_.emplace(s.index, s).second) << "drawn twice: " << s.index;
      EXPECT_NEAR(norm(s.normal), 1.0, 1e-12);
    }
    for (const std::uint32_t index : tracker.takeHidden()) {
      ASSERT_EQ(drawn_.erase(index), 1u) << "hidden but never drawn: " << index;
    }
  }
  void expectEquals(const std::vector<Splat>& scanned) const {
    ASSERT_EQ(drawn_.size(), scanned.size());
    for (const Splat& s : scanned) {
      const auto found = drawn_.find(s.index);
      ASSERT_NE(found, drawn_.end()) << "not drawn: " << s.index;
      EXPECT_EQ(found->second.kind, s.kind);
      EXPECT_EQ(found->second.position_mm, s.position_mm);
    }
  }

 private:
  std::map<std::uint32_t, Splat> drawn_;
};

TEST(SplatTracker, EqualsAFullScanAfterThousandsOfRandomRemovals) {
  Random random(20020420);
  for (int round = 0; round < 20; ++round) {
    PointVolume volume = solid({0.1, 2 + static_cast<int>(random.below(8)), 1 + static_cast<int>(random.below(12)), 0});
    for (std::uint64_t& word : volume.alive) word &= random.bits() | random.bits();
    const PointVolume before = volume;
    SplatTracker tracker(volume);
    Client client;
    for (int cycle = 0; cycle < 300; ++cycle) {
      std::set<std::uint32_t> removed;
      for (std::uint64_t n = random.below(6); n > 0; --n) {
        const auto index = static_cast<std::uint32_t>(random.below(volume.lattice.points()));
        if (volume.isAlive(index)) removed.insert(index);
        kill(volume, index);
      }
      const std::vector<std::uint32_t> indices(removed.begin(), removed.end());
      tracker.update(volume, indices, {{0, 0, 0.01 * cycle}, {0, 0, 1}, 0.3, 0.5});
      if (random.below(3) == 0) {
        client.take(tracker, volume);
        client.expectEquals(scan(volume, before));
      }
      if (HasFatalFailure()) FAIL() << "round " << round << " cycle " << cycle;
    }
  }
}

TEST(SplatTracker, EqualsAFullScanWhileTheBitWandersThroughRaggedBone) {
  Random random(20020421);
  const plan::Bit bit{0.8, 0.6, 5.0};
  PointVolume volume = solid({0.1, 9, 30, -3});
  for (std::uint32_t i = 0; i < volume.lattice.points(); ++i) {
    if (volume.lattice.site(i).disc < 3 + volume.lattice.site(i).ring / 2) kill(volume, i);
  }
  const PointVolume before = volume;
  SplatTracker tracker(volume);
  auto session = session::Session::create(volume, {bit, "reference"}).value();
  Client client;
  for (int cycle = 0; cycle < 3000; ++cycle) {
    session::Input input{static_cast<std::uint64_t>(1000 * cycle), {}, {}, true};
    input.tip_mm = {random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), -0.3 + 0.001 * cycle};
    input.axis = normalized({random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), 1});
    std::vector<std::uint32_t> removed;
    const session::Output output = session.step(
        input, [&](std::span<const std::uint32_t> some) { removed.insert(removed.end(), some.begin(), some.end()); });
    ASSERT_EQ(output.removed, removed.size());
    tracker.update(session.volume(), removed, {input.tip_mm, input.axis, 0.4, 0.6});
    if (cycle % 16 == 0) client.take(tracker, session.volume());
    if (cycle % 160 == 0) client.expectEquals(scan(session.volume(), before));
    if (HasFatalFailure()) FAIL() << "cycle " << cycle;
  }
}

TEST(CutNormal, PointsToTheAxisBesideTheCylinderAndOffTheConeBesideIt) {
  const Cut cut{{1, 0, 10}, {0, 0, 1}, 1.5, 5};
  EXPECT_EQ(cutNormal(cut, {3, 0, 2}), (Vec3{-1, 0, 0}));
  const Vec3 beside_cone = cutNormal(cut, {1, 2, 8});
  EXPECT_NEAR(norm(beside_cone), 1.0, 1e-15);
  EXPECT_NEAR(dot(beside_cone, {0, 1.5, -5}), 0.0, 1e-15) << "at right angles to the slant";
  EXPECT_LT(beside_cone.y, 0);
  EXPECT_LT(beside_cone.z, 0) << "back toward where the bit came from";
  EXPECT_EQ(cutNormal(cut, {1, 0, 11}), (Vec3{0, 0, -1})) << "straight ahead";
  EXPECT_EQ(cutNormal({{0, 0, 0}, {0, 0, 1}, 1.5, 0}, {0.7, 0, 0.1}), (Vec3{0, 0, -1})) << "below a flat end";
  EXPECT_EQ(cutNormal({{0, 0, 0}, {0, 0, 1}, 1.5, 0}, {1.7, 0, -0.1}), (Vec3{-1, 0, 0})) << "beside it";
}

TEST(EstimatedNormals, OfAPlaneAtAnyTiltAreWithinTwentyFiveDegreesAndEightOnAverage) {
  Random random(20020422);
  const Lattice lattice{0.1, 15, 30, 0};
  const auto disc = point_volume::discTable(lattice);
  double worst = 1, sum = 0;
  int count = 0;
  for (int round = 0; round < 40; ++round) {
    const Vec3 tilt = normalized({random.gaussian(), random.gaussian(), random.gaussian()});
    PointVolume volume = solid(lattice);
    const Vec3 middle{0, 0, 1.5};
    for (std::uint32_t i = 0; i < lattice.points(); ++i) {
      if (dot(positionOf(lattice, disc, i) - middle, tilt) > 0) kill(volume, i);
    }
    for (const Splat& s : scan(volume, volume)) {
      const Site site = lattice.site(s.index);
      if (site.ring > 12 || site.disc < 2 || site.disc > 27) continue;  // the window is whole
      worst = std::min(worst, dot(s.normal, tilt));
      sum += dot(s.normal, tilt);
      ++count;
    }
  }
  ASSERT_GT(count, 10000);
  EXPECT_GT(worst, std::cos(25 * 3.14159265 / 180));
  EXPECT_GT(sum / count, std::cos(8 * 3.14159265 / 180));
}

TEST(OuterNormals, AreTheCallersWhereItHasThemAndEstimatedWhereItHasNone) {
  PointVolume volume = solid({0.1, 6, 8, 0});
  for (std::uint32_t i = 0; i < 3 * volume.lattice.pointsPerDisc(); ++i) kill(volume, i);
  const auto splats = scan(volume, volume, [](std::span<const Vec3> points, std::span<Vec3> out) {
    for (std::size_t i = 0; i < points.size(); ++i) out[i] = points[i].x > 0 ? Vec3{0, 3, -4} : Vec3{};
  });
  ASSERT_EQ(splats.size(), volume.lattice.pointsPerDisc());
  for (const Splat& s : splats) {
    EXPECT_EQ(s.kind, Kind::OuterSurface);
    if (s.position_mm.x > 0) {
      EXPECT_NEAR(norm(s.normal - Vec3{0, 0.6, -0.8}), 0, 1e-15);
    } else {
      EXPECT_LT(s.normal.z, -0.9);
    }
  }
}

TEST(CoveringRadius, ReachesEveryPlaceInsideTheLatticeAndIsNotWasteful) {
  const Lattice lattice{1.0, 30, 3, 0};
  const auto disc = point_volume::discTable(lattice);
  Random random(20020423);
  double farthest = 0;
  for (int i = 0; i < 20000; ++i) {
    Vec3 place{random.uniform(-28, 28), random.uniform(-28, 28), random.uniform(0, 2)};
    if (place.x * place.x + place.y * place.y > 28 * 28) continue;
    double nearest = 1e9;
    for (std::uint32_t p = 0; p < lattice.pointsPerDisc(); ++p) {
      const double dx = disc.x_mm[p] - place.x, dy = disc.y_mm[p] - place.y;
      nearest = std::min(nearest, dx * dx + dy * dy);
    }
    const double dz = place.z - std::floor(place.z + 0.5);
    farthest = std::max(farthest, std::sqrt(nearest + dz * dz));
  }
  EXPECT_LE(farthest, kCoveringRadiusPerSpacing);
  EXPECT_GT(farthest, 0.9 * kCoveringRadiusPerSpacing);
}

}  // namespace
}  // namespace spinaltap::splats
