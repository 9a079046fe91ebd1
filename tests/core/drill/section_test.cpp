#include "core/drill/section.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/base/dmath.h"
#include "core/base/random.h"

namespace spinaltap::drill {
namespace {

using point_volume::Lattice;

const Lattice kLattice{0.1, 60, 300, -100};

plan::Bit randomBit(Random& random) {
  const double length = random.uniform(1, 60);
  const double cone = random.below(4) == 0   ? 0.0
                      : random.below(4) == 0 ? random.uniform(0, 0.1)
                                             : random.uniform(0, length);
  return {random.uniform(0.5, 8), cone, length};
}

BitPose randomPose(Random& random) {
  const SinCos tilt = sinCos((random.below(2) == 0 ? random.uniform(0, 3) : random.uniform(0, 180)) * kPi / 180);
  const SinCos azimuth = sinCos(random.uniform(0, 2 * kPi));
  return {{random.uniform(-4, 4), random.uniform(-4, 4), random.uniform(-12, 30)},
          {tilt.sin * azimuth.cos, tilt.sin * azimuth.sin, tilt.cos}};
}

/// A point of a disc, as often as not close to the rim of a circle around the section.
Vec3 pointOf(Random& random, const Section& section, int disc) {
  const SinCos angle = sinCos(random.uniform(0, 2 * kPi));
  const double rim = random.below(2) == 0 ? section.outer_mm : std::max(0.0, section.inner_mm);
  const double radius = random.below(3) == 0 ? random.uniform(0, 6) : std::max(0.0, rim + random.uniform(-3e-5, 3e-5));
  return {section.x_mm + radius * angle.cos, section.y_mm + radius * angle.sin, kLattice.discZ_mm(disc)};
}

TEST(Section, LiesBetweenItsCircles) {
  Random random(41);
  int inside = 0, sure = 0, flat = 0;
  for (int i = 0; i < 20000; ++i) {
    const BitShape bit = shapeOf(randomBit(random));
    const BitPose pose = randomPose(random);
    for (const double slack_mm : {0.0, 1e-4}) {
      const Sections sections(bit, pose, kLattice, slack_mm);
      if (sections.isFlat()) {
        ++flat;
        continue;
      }
      for (int k = 0; k < 20; ++k) {
        const int disc = static_cast<int>(random.below(300));
        const bool reached = disc >= sections.first() && disc <= sections.last();
        const About about = sections.isConed() && k % 2 == 0 ? About::Cone : About::Shaft;
        const Section section = reached ? sections.at(disc, about) : Section{0, 0, -1, -1};
        const Vec3 point = pointOf(random, section, disc);
        const double away = std::hypot(point.x - section.x_mm, point.y - section.y_mm);
        // A predicate that errs by the slack may take what a wider bit takes, and must take what a thinner one does.
        BitShape wider = bit, thinner = bit;
        wider.radius_mm += slack_mm, wider.radius_squared = wider.radius_mm * wider.radius_mm * (1 + 1e-9);
        thinner.radius_squared = (bit.radius_mm - slack_mm) * (bit.radius_mm - slack_mm);
        if (isInside(slack_mm > 0 ? wider : bit, pose.tip_mm, pose.axis, point)) {
          ++inside;
          ASSERT_LE(away, section.outer_mm) << "case " << i;
        }
        if (away <= section.inner_mm) {
          ++sure;
          ASSERT_TRUE(isInside(slack_mm > 0 ? thinner : bit, pose.tip_mm, pose.axis, point)) << "case " << i;
        }
      }
    }
  }
  EXPECT_GT(inside, 20000);
  EXPECT_GT(sure, 10000);
  EXPECT_GT(flat, 1000);
}

TEST(Section, IsTheSameInSingles) {
  Random random(42);
  int beyond = 0;
  for (int i = 0; i < 20000; ++i) {
    const BitShape bit = shapeOf(randomBit(random));
    const BitPose pose = randomPose(random);
    const Sections sections(bit, pose, kLattice);
    if (sections.isFlat() || sections.first() > sections.last()) continue;
    const int first = sections.first() + static_cast<int>(random.below(3)),
              disc = first + static_cast<int>(random.below(80));
    if (disc > sections.last()) continue;
    const SectionLine line = sections.line(first);
    const float along = line.along_0 - static_cast<float>(disc - first) * line.along_step;
    const float cone = line.cone_offset + line.cone_slope * along;
    const float outer = std::min(cone, line.shaft_radius);
    const bool in_cone = line.about(outer) == About::Cone;
    const Section section = sections.at(disc, line.about(outer));
    if (along < line.first_along) {  // beyond the tip: the bit misses the disc
      ++beyond;
      for (int k = 0; k < 20; ++k) {
        const Vec3 point = pointOf(random, section, disc);
        ASSERT_FALSE(isInside(bit, pose.tip_mm, pose.axis, point)) << "case " << i;
      }
      continue;
    }
    const float x = line.tip_x - along * (in_cone ? line.cone_x : line.shaft_x);
    const float y = line.tip_y - along * (in_cone ? line.cone_y : line.shaft_y);
    // The circle in singles holds the other one.
    const double apart = std::hypot(static_cast<double>(x) - section.x_mm, static_cast<double>(y) - section.y_mm);
    ASSERT_GE(static_cast<double>(outer), section.outer_mm + apart - 1e-12) << "case " << i;
    ASSERT_LE(static_cast<double>(outer), section.outer_mm + 2 * sections.margin_mm()) << "case " << i;
  }
  EXPECT_GT(beyond, 100);
}

}  // namespace
}  // namespace spinaltap::drill
