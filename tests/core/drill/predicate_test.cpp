#include "core/drill/predicate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/dmath.h"
#include "core/base/random.h"
#include "core/drill/engine.h"

namespace spinaltap::drill {
namespace {

using point_volume::Lattice;

const Vec3 kUp{0, 0, 1};

TEST(Predicate, HoldsTheTipTheBaseAndTheEndAsClosedSets) {
  const BitShape bit = shapeOf({3.0, 5.0, 50.0});
  const Vec3 tip{0, 0, 10};
  EXPECT_TRUE(isInside(bit, tip, kUp, {0, 0, 10}));          // the apex
  EXPECT_FALSE(isInside(bit, tip, kUp, {0, 0, 10 + 1e-8}));  // past it by ten touches
  EXPECT_TRUE(isInside(bit, tip, kUp, {1.5, 0, 5}));         // where the cone meets the cylinder
  EXPECT_FALSE(isInside(bit, tip, kUp, {1.5 + 1e-8, 0, 5}));
  EXPECT_FALSE(isInside(bit, tip, kUp, {1.5, 0, 5 + 1e-7}));  // the cone is narrower by 3e-8 there
  EXPECT_TRUE(isInside(bit, tip, kUp, {0.75, 0, 7.5}));       // half way up the cone
  EXPECT_FALSE(isInside(bit, tip, kUp, {0.75 + 1e-8, 0, 7.5}));
  EXPECT_TRUE(isInside(bit, tip, kUp, {1.5, 0, -40}));  // the end
  EXPECT_FALSE(isInside(bit, tip, kUp, {1.5, 0, -40 - 1e-8}));
}

TEST(Predicate, GivesAFlatEndToABitWithoutACone) {
  for (const double cone : {0.0, 5e-324, 1e-310, 1e-12}) {
    const BitShape bit = shapeOf({3.0, cone, 50.0});
    EXPECT_TRUE(isInside(bit, {0, 0, 0}, kUp, {1.5, 0, 0})) << cone;
    EXPECT_FALSE(isInside(bit, {0, 0, 0}, kUp, {1.5, 0, 1e-8})) << cone;
    EXPECT_FALSE(isInside(bit, {0, 0, 0}, kUp, {1.5 + 1e-8, 0, -1})) << cone;
    EXPECT_FALSE(isInside(bit, {0, 0, 0}, kUp, {500, 0, -5e-324})) << cone;
  }
}

TEST(Predicate, MeetsTheCylinderWithTheConeWithoutAStep) {
  // The report's factor (1-a) * cone / total would leave a step here; see the design, section 7.
  Random random(3);
  for (int i = 0; i < 1000; ++i) {
    const double diameter = random.uniform(0.5, 8), cone = random.uniform(0.1, 20);
    const BitShape bit = shapeOf({diameter, cone, 60.0});
    for (const double before : {1e-6, 1e-3}) {
      const double slope = bit.radius_mm / cone;
      EXPECT_TRUE(isInside(bit, {}, kUp, {bit.radius_mm - slope * before, 0, -cone + before}));
      EXPECT_FALSE(isInside(bit, {}, kUp, {bit.radius_mm + 1e-7, 0, -cone + before}));
    }
  }
}

/// The predicate in long double, from its words and not from its code: distance to the bit's body is at most the touch.
long double excess(const plan::Bit& bit, const Vec3& tip, const Vec3& axis, const Vec3& point) {
  const long double x = static_cast<long double>(point.x) - tip.x, y = static_cast<long double>(point.y) - tip.y,
                    z = static_cast<long double>(point.z) - tip.z;
  const long double along = -(x * axis.x + y * axis.y + z * axis.z);
  const long double radial = std::sqrt(std::max(0.0L, x * x + y * y + z * z - along * along));
  const long double radius = along >= bit.cone_length_mm
                                 ? bit.diameter_mm / 2.0L
                                 : std::max(0.0L, along) / bit.cone_length_mm * bit.diameter_mm / 2.0L;
  return std::max({-along, along - bit.length_mm, radial - radius});
}

TEST(Predicate, AgreesWithLongDoubleWhereverTheTouchIsNotInQuestion) {
  Random random(11);
  int inside = 0, close = 0;
  for (int i = 0; i < 300000; ++i) {
    const plan::Bit bit{random.uniform(0.5, 8), random.uniform(0.01, 20), random.uniform(20, 60)};
    const Vec3 axis =
        normalized(Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)} + Vec3{0, 0, 1e-3});
    const Vec3 tip{random.uniform(-40, 40), random.uniform(-40, 40), random.uniform(-40, 40)};
    const double along = random.uniform(-1, bit.length_mm + 1);
    Vec3 side = cross(axis, Vec3{random.unit(), 1, 0.3});
    side = side / norm(side) * (random.unit() * bit.diameter_mm * 0.6);
    const Vec3 point = tip - axis * along + side;
    const long double e = excess(bit, tip, axis, point);
    const bool ours = isInside(shapeOf(bit), tip, axis, point);
    inside += ours;
    // The axis is a unit vector to 2e-16 and coordinates are below 110 mm: both sides are good to far better than
    // 1e-10.
    if (std::fabs(static_cast<double>(e) - kTouch_mm) < 1e-10) {
      ++close;
    } else {
      ASSERT_EQ(ours, static_cast<double>(e) <= kTouch_mm) << "case " << i;
    }
  }
  EXPECT_GT(inside, 30000);
  EXPECT_LT(close, 10);
}

TEST(Predicate, InSinglesErrsNoFartherFromTheSurfaceThanItSays) {
  Random random(12);
  int wrong = 0;
  for (int i = 0; i < 400000; ++i) {
    const plan::Bit bit{random.uniform(0.5, 8), random.uniform(0.1, 20), random.uniform(20, 60)};
    const Vec3 axis =
        normalized(Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)} + Vec3{0, 0, 1e-3});
    const Vec3 tip{random.uniform(-30, 30), random.uniform(-30, 30), random.uniform(-30, 30)};
    // Close to the surface, at a random depth around it.
    const double along = random.uniform(-1e-4, bit.length_mm + 1e-4);
    const double radius =
        std::min(bit.diameter_mm / 2, std::max(0.0, along) / bit.cone_length_mm * bit.diameter_mm / 2);
    Vec3 side = cross(axis, Vec3{random.unit(), 1, 0.3});
    side = side / norm(side) * std::max(0.0, radius + random.uniform(-1e-4, 1e-4));
    const Vec3 point = tip - axis * along + side;
    const BitShape shape = shapeOf(bit);
    if (isInside<float>(shape, tip, axis, point) == isInside(shape, tip, axis, point)) continue;
    ++wrong;
    const double bound = singleError_mm(shape, std::max(norm(tip), norm(point)));
    // The distance across the axis is the farthest that moving the surface by the bound can have changed.
    ASSERT_LE(std::abs(static_cast<double>(excess(bit, tip, axis, point))), bound) << "case " << i;
  }
  EXPECT_GT(wrong, 1000);
}

/// How many points of a ring are gone from the first disc.
int goneFromRing(const point_volume::PointVolume& volume, int ring) {
  int gone = 0;
  for (int slot = 0; slot < Lattice::slotsOf(ring); ++slot)
    gone += !volume.isAlive(volume.lattice.index({0, ring, slot}));
  return gone;
}

TEST(Predicate, TakesARingExactlyAsWideAsTheBitWholeOrNotAtAll) {
  for (const double spacing : {0.5, 0.1, 0.05, 1.0 / 3.0, 0.07}) {
    for (int ring = 1; ring <= 80; ++ring) {
      const double diameter = 2 * (ring * spacing);
      if (diameter < 0.5 || diameter > 8) continue;
      auto volume = *point_volume::solidVolume({spacing, ring + 3, 1, 0}, 300);
      for (const std::string_view name : engineNames()) {
        auto copy = volume;
        const auto engine = *makeEngine(name, copy, {diameter, 5, 50});
        engine->step(copy, {{0, 0, 5}, kUp});  // the disc is at the cone's base
        for (int k = 0; k < ring + 3; ++k) {
          ASSERT_EQ(goneFromRing(copy, k), k <= ring ? Lattice::slotsOf(k) : 0) << name << " " << spacing << " " << k;
        }
      }
      // A bit thinner by a ten-millionth of a millimetre leaves the ring whole.
      const auto thin = *makeEngine("clearance", volume, {diameter - 1e-7, 5, 50});
      if (diameter - 1e-7 >= 0.5) thin->step(volume, {{0, 0, 6}, kUp});
      ASSERT_EQ(goneFromRing(volume, ring), 0);
    }
  }
}

TEST(Predicate, TakesARingInTwoArcsWhenTheBitIsTilted) {
  // Tilted 70 degrees the section is an ellipse, 1.5 mm by 4.4 mm: it meets the ring of 2.5 mm in two arcs.
  const Lattice lattice{0.1, 40, 1, 0};
  auto volume = *point_volume::solidVolume(lattice, 300);
  const SinCos tilt = sinCos(70 * kPi / 180);
  const Vec3 axis{tilt.sin, 0, tilt.cos};
  const auto engine = *makeEngine("clearance", volume, {3.0, 5.0, 60.0});
  engine->step(volume, {axis * 30.0, axis});
  int ends = 0;
  const int ring = 25, slots = Lattice::slotsOf(ring);
  for (int slot = 0; slot < slots; ++slot) {
    ends +=
        volume.isAlive(lattice.index({0, ring, slot})) != volume.isAlive(lattice.index({0, ring, (slot + 1) % slots}));
  }
  EXPECT_EQ(ends, 4);
  EXPECT_FALSE(volume.isAlive(lattice.index({0, ring, 0})));
  EXPECT_FALSE(volume.isAlive(lattice.index({0, ring, slots / 2})));
  EXPECT_TRUE(volume.isAlive(lattice.index({0, ring, slots / 4})));
}

}  // namespace
}  // namespace spinaltap::drill
