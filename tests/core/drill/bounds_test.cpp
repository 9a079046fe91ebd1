#include "core/drill/bounds.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/dmath.h"
#include "core/base/random.h"

namespace spinaltap::drill {
namespace {

using point_volume::Lattice;

TEST(RoughArcCos, IsAsGoodAsItSays) {
  for (int i = -100000; i <= 100000; ++i) {
    const double x = i / 100000.0;
    ASSERT_NEAR(roughArcCos(x), std::acos(x), kAngleError_rad) << x;
  }
}

BitPose randomPose(Random& random) {
  BitPose pose;
  pose.tip_mm = {random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5)};
  const double tilt_deg = random.below(3) == 0 ? random.uniform(88, 92) : random.uniform(0, 180);
  const SinCos tilt = sinCos(tilt_deg * kPi / 180), azimuth = sinCos(random.uniform(0, 2 * kPi));
  pose.axis = random.below(8) == 0 ? Vec3{0, 0, 1} : Vec3{tilt.sin * azimuth.cos, tilt.sin * azimuth.sin, tilt.cos};
  return pose;
}

/// A point on the bit's surface, where bounds fail first.
Vec3 surfacePoint(Random& random, const BitShape& bit, const BitPose& pose) {
  const double along = random.below(4) == 0 ? 0.0 : random.uniform(0, bit.length_mm);
  const double radius = along >= bit.cone_mm ? bit.radius_mm : along * bit.radius_per_cone;
  const Vec3 helper = std::abs(pose.axis.z) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0};
  const Vec3 u = normalized(cross(pose.axis, helper)), v = cross(pose.axis, u);
  const double angle = random.uniform(0, 2 * kPi);
  return pose.tip_mm - pose.axis * along + (u * std::cos(angle) + v * std::sin(angle)) * radius;
}

TEST(SectionCircle, HoldsEveryPointOfTheBitAtItsHeight) {
  Random random(5);
  for (int i = 0; i < 200000; ++i) {
    const plan::Bit chosen{random.uniform(0.5, 8), random.below(4) == 0 ? 0.0 : random.uniform(0, 20),
                           random.uniform(20, 60)};
    const BitShape bit = shapeOf(chosen);
    const BitPose pose = randomPose(random);
    const Vec3 point = surfacePoint(random, bit, pose);
    const Span reach = reachAlongPath(bit, pose);
    ASSERT_LE(reach.low_mm, point.z);
    ASSERT_GE(reach.high_mm, point.z);
    const Circle circle = sectionCircle(bit, pose, point.z);
    ASSERT_GE(circle.radius_mm, 0);
    ASSERT_LE(std::hypot(point.x - circle.x_mm, point.y - circle.y_mm), circle.radius_mm) << "case " << i;
  }
}

TEST(SectionCircle, IsTightOnThePath) {
  const BitShape bit = shapeOf({3.0, 5.0, 50.0});
  const BitPose pose{{0, 0, 10}, {0, 0, 1}};
  EXPECT_NEAR(sectionCircle(bit, pose, 0).radius_mm, 1.5, 2 * kMargin_mm);
  EXPECT_NEAR(sectionCircle(bit, pose, 7.5).radius_mm, 0.75, 2 * kMargin_mm);
  EXPECT_LT(sectionCircle(bit, pose, 10.1).radius_mm, 0);
  EXPECT_LT(sectionCircle(bit, pose, -40.1).radius_mm, 0);
}

TEST(SlotsInside, HoldsEverySlotInsideTheCircleAndFewMore) {
  Random random(6);
  std::uint64_t inside = 0, chosen = 0;
  for (int i = 0; i < 60000; ++i) {
    const double spacing = random.uniform(0.01, 0.5);
    const int ring = 1 + static_cast<int>(random.below(80)), slots = Lattice::slotsOf(ring);
    const double r = ring * spacing, size = std::ldexp(1.0, -static_cast<int>(random.below(24)));
    // Often a circle that only grazes the ring, or is nearly concentric with it.
    const double d = random.below(3) == 0 ? size : random.uniform(0, 2 * r);
    const double radius = random.below(3) == 0 ? std::abs(r - d) + size : random.uniform(0, 2 * r);
    const double angle = random.uniform(0, 2 * kPi);
    const Circle circle{d * std::cos(angle), d * std::sin(angle), radius + kMargin_mm};
    const SlotRange range = slotsInside(polar(circle), ring, spacing);
    ASSERT_GE(range.first, 0);
    ASSERT_LT(range.first, slots);
    ASSERT_GE(range.count, 0);
    ASSERT_LE(range.count, slots);
    for (int slot = 0; slot < slots; ++slot) {
      const SinCos at = sinCosOfTurn(slot, slots);
      if (std::hypot(r * at.cos - circle.x_mm, r * at.sin - circle.y_mm) > radius) continue;
      ++inside;
      ASSERT_LT((slot - range.first + slots) % slots, range.count) << "case " << i << " slot " << slot;
    }
    chosen += static_cast<std::uint64_t>(range.count);
  }
  // A slot or so at each end, and whole rings where the circle is concentric to within the margin.
  EXPECT_LT(static_cast<double>(chosen), 1.1 * static_cast<double>(inside));
}

}  // namespace
}  // namespace spinaltap::drill
