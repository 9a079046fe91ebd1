// The engines at the ends of what they accept: the least step, the finest lattice, the longest path, the thinnest bit.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/base/dmath.h"
#include "core/base/random.h"
#include "core/drill/engine.h"
#include "core/plan/path.h"

namespace spinaltap::drill {
namespace {

using point_volume::Lattice;
using point_volume::PointVolume;

/// The engine beside one that is known to be right, on copies of the same volume.
class Pair {
 public:
  Pair(PointVolume volume, const plan::Bit& bit, const char* truth = "reference")
      : a_(std::move(volume)), b_(a_), truth_(*makeEngine(truth, a_, bit)), ours_(*makeEngine("clearance", b_, bit)) {}

  void step(const BitPose& pose) {
    const Removal truth = truth_->step(a_, pose), ours = ours_->step(b_, pose);
    same_ = same_ && truth.count == ours.count && truth.hash_delta == ours.hash_delta &&
            truth.density_sum_mg_cm3 == ours.density_sum_mg_cm3;
    removed_ += ours.count, density_ += ours.density_sum_mg_cm3;
  }
  [[nodiscard]] bool same() const { return same_ && a_.alive == b_.alive; }
  [[nodiscard]] std::uint64_t removed() const { return removed_; }
  [[nodiscard]] std::uint64_t density() const { return density_; }
  [[nodiscard]] const PointVolume& volume() const { return b_; }

 private:
  PointVolume a_, b_;
  std::unique_ptr<Engine> truth_, ours_;
  bool same_ = true;
  std::uint64_t removed_ = 0, density_ = 0;
};

PointVolume solid(const Lattice& lattice) { return *point_volume::solidVolume(lattice, 300); }

Vec3 tilted(double tilt_deg, double azimuth_deg) {
  const SinCos tilt = sinCos(tilt_deg * kPi / 180), azimuth = sinCos(azimuth_deg * kPi / 180);
  return {tilt.sin * azimuth.cos, tilt.sin * azimuth.sin, tilt.cos};
}

TEST(Extremes, AMillionStepsOfANanometreEndWhereOneStepOfAMillimetreDoes) {
  const plan::Bit bit{0.5, 0.4, 5};
  for (const Vec3& axis : {Vec3{0, 0, 1}, tilted(7, 30)}) {
    Pair pair(solid({0.1, 3, 12, 0}), bit);
    std::uint64_t last = 0;
    for (int i = 0; i <= 1000000; ++i) {
      pair.step({{0.03, 0.01, 1e-6 * i}, axis});
      ASSERT_GE(pair.removed(), last);  // the report's drill ran backwards
      last = pair.removed();
    }
    EXPECT_TRUE(pair.same());
    EXPECT_GT(pair.removed(), 100u);
    // Upright and moving along itself, the bit ends having swept what it swept in 200 steps.
    if (axis.z < 1) continue;
    PointVolume coarse = solid({0.1, 3, 12, 0});
    const auto engine = *makeEngine("reference", coarse, bit);
    for (int i = 0; i <= 200; ++i) engine->step(coarse, {{0.03, 0.01, 0.005 * i}, axis});
    EXPECT_EQ(coarse.alive, pair.volume().alive);
  }
}

TEST(Extremes, AFiftiethOfAMillimetreOverSixtyMillimetres) {
  // Beside `bounded`, which the reference vouches for elsewhere: 7.8 million points a cycle are beyond the reference.
  Pair pair(solid({0.02, 30, 3000, 0}), {0.6, 2.0, 40}, "bounded");
  for (int i = 0; i < 400; ++i) {
    const SinCos tremor = sinCos(0.7 * i);
    pair.step({{0.1 * tremor.sin, 0.1 * tremor.cos, 0.16 * i}, tilted(0.3 + 0.2 * tremor.sin, i)});
  }
  EXPECT_TRUE(pair.same());
  EXPECT_GT(pair.removed(), 500000u);
}

TEST(Extremes, PathsFromAFifthOfAMillimetreToTwoHundred) {
  for (const double length_mm : {0.2, 200.0}) {
    plan::Path path;
    path.target_patient = {0, 0, length_mm};
    path.bit = {1.0, 1.0, 60};
    path.volume_radius_mm = 0.9;
    ASSERT_TRUE(plan::checkPath(path).has_value());
    const Lattice lattice = point_volume::latticeOf(path);
    Pair pair(solid(lattice), path.bit);
    for (int i = 0; i <= 60; ++i) {
      pair.step({{0.05, -0.02, length_mm * i / 50.0}, tilted(0.1, 6.0 * i)});
    }
    EXPECT_TRUE(pair.same()) << length_mm;
    EXPECT_GT(pair.removed(), 5u);
  }
}

TEST(Extremes, APatientAKilometreFromTheScannersOrigin) {
  // The same poses of the hand, in the patient's frame, there and here. A coordinate of 1e6 mm is known to 1.2e-10 mm,
  // below the predicate's touch; the path's direction, from two such points, to 1e-11 a millimetre of path.
  const Vec3 far{1e6, -7e5, 3e5}, entry{0.25, -0.5, 0.125}, target{0.25, 8.5, 12.125};
  plan::Path here, there;
  here.entry_patient = entry, here.target_patient = target;
  there.entry_patient = entry + far, there.target_patient = target + far;
  here.bit = there.bit = {2.0, 2.0, 30};
  here.volume_radius_mm = there.volume_radius_mm = 1.5;
  const Lattice lattice = point_volume::latticeOf(here);
  ASSERT_EQ(point_volume::latticeOf(there), lattice);
  PointVolume a = solid(lattice), b = a;
  const auto near_engine = *makeEngine("clearance", a, here.bit), far_engine = *makeEngine("clearance", b, there.bit);
  const Frame near_frame = plan::pathFrame(here), far_frame = plan::pathFrame(there);
  Random random(3);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 tremor{random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1)};
    const Vec3 tip = entry + (target - entry) * (i / 2000.0) + tremor;
    const Vec3 axis = normalized(target - entry + tremor);
    near_engine->step(a, {near_frame.toLocal(tip), near_frame.directionToLocal(axis)});
    far_engine->step(b, {far_frame.toLocal(tip + far), far_frame.directionToLocal(axis)});
  }
  EXPECT_EQ(a.alive, b.alive);
  EXPECT_GT(lattice.points() - countAlive(a), 30000u);
}

TEST(Extremes, ABitThinnerThanARing) {
  Pair pair(solid({1.0, 6, 30, -5}), {0.5, 0.5, 20});
  for (int i = 0; i < 3000; ++i) {
    const SinCos turn = sinCos(0.01 * i);
    pair.step({{3 * turn.sin, 3 * turn.cos, 0.008 * i - 2}, tilted(3 * turn.sin, i)});
  }
  EXPECT_TRUE(pair.same());
  EXPECT_GT(pair.removed(), 20u);
}

TEST(Extremes, ABitTangentToADisc) {
  // It lies on the disc: what it touches is a line, and a bit a millionth higher touches nothing.
  const plan::Bit bit{2.0, 0, 30};
  for (const double above_mm : {0.0, 1e-6}) {
    Pair pair(solid({0.1, 10, 3, -2}), bit);
    pair.step({{15, 0, 1.0 + above_mm}, {1, 0, 0}});
    EXPECT_TRUE(pair.same());
    EXPECT_EQ(pair.removed(), above_mm > 0 ? 0u : 19u);  // along y = 0 of the topmost disc, at z = 0
  }
  // A flat end that touches a disc takes the circle, one that stays a millionth away takes nothing.
  for (const double short_mm : {0.0, 1e-6}) {
    Pair pair(solid({0.1, 10, 3, 5}), bit);
    pair.step({{0, 0, 0.5 - short_mm}, {0, 0, 1}});
    EXPECT_TRUE(pair.same());
    EXPECT_EQ(pair.removed(), short_mm > 0 ? 0u : 3u * 10 * 9 + 1);
  }
}

TEST(Extremes, DensitiesAtBothEndsOfTheirRange) {
  for (const std::uint16_t density : {std::uint16_t{0}, std::uint16_t{65535}}) {
    Pair pair(*point_volume::solidVolume({0.1, 20, 60, 0}, density), {3, 2, 30});
    for (int i = 0; i < 40; ++i) pair.step({{0.2, 0.1, 0.2 * i}, tilted(1, 9 * i)});
    EXPECT_TRUE(pair.same());
    EXPECT_GT(pair.removed(), 10000u);
    EXPECT_EQ(pair.density(), pair.removed() * density);
  }
}

TEST(Extremes, SumsOfMoreThanABillionRemovedPointsStayExact) {
  // Every point of 1.4e12 at the highest density would still fit; a double would not count them one by one.
  Removal sum;
  const Removal cycle{999'999'937, 999'999'937ULL * 65535, 0x9e3779b97f4a7c15ULL, 1};
  for (std::uint64_t i = 1; i <= 1000; ++i) {
    sum += cycle;
    ASSERT_EQ(sum.count, i * cycle.count);
    ASSERT_EQ(sum.density_sum_mg_cm3, i * cycle.density_sum_mg_cm3);
    ASSERT_EQ(sum.hash_delta, i * cycle.hash_delta);
  }
  EXPECT_EQ(sum.density_sum_mg_cm3 / 65535, sum.count);
}

}  // namespace
}  // namespace spinaltap::drill
