#include "core/tradeoff/swept_volume.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/base/dmath.h"
#include "core/base/random.h"
#include "core/drill/predicate.h"
#include "core/session/scenes.h"

namespace spinaltap::tradeoff {
namespace {

using drill::BitPose;

/// An upright bit pushed down to `depth`: a cone, then a cylinder.
double holeOf(const plan::Bit& bit, double depth) {
  const double r = 0.5 * bit.diameter_mm, in_cone = std::min(depth, bit.cone_length_mm);
  const double wide = bit.cone_length_mm > 0 ? r * in_cone / bit.cone_length_mm : r;
  const double cone = bit.cone_length_mm > 0 ? kPi * wide * wide * in_cone / 3 : 0;
  return cone + kPi * r * r * std::max(0.0, depth - bit.cone_length_mm);
}

std::vector<BitPose> upright(double x, double step, int count) {
  std::vector<BitPose> poses;
  for (int n = 0; n <= count; ++n) poses.push_back({{x, 0, step * n}, {0, 0, 1}});
  return poses;
}

/// Within five of the standard errors that it states, and these small: odds of some 1e-3 by Student's t of 7 degrees,
/// and the seed is fixed. The added 1e-9 is for the cases where all estimates agree to rounding.
void expectWithin(const Swept& swept, double truth, double relative) {
  EXPECT_NEAR(swept.total_mm3, truth, 5 * swept.error_mm3 + 1e-9 * truth);
  EXPECT_LT(swept.error_mm3, relative * truth);
}

TEST(SweptVolume, OfAnUprightBitIsConeAndCylinder) {
  for (const plan::Bit& bit :
       {plan::Bit{3, 5, 50}, plan::Bit{3, 0, 20}, plan::Bit{0.5, 0.2, 20}, plan::Bit{8, 12, 40}}) {
    for (const double x : {0.0, 1.0}) {
      SCOPED_TRACE(testing::Message() << bit.diameter_mm << " mm wide, cone " << bit.cone_length_mm << ", at " << x);
      const auto poses = upright(x, 0.25, 40);
      // The shaft's wall is a step from 0 to 10 mm: the worst for columns, some parts in a thousand of these.
      const Swept swept = sweptVolume(bit, poses, 0, {.columns = 2000});
      expectWithin(swept, holeOf(bit, 10), x == 0 ? 2e-3 : 6e-3);
      double so_far = 0;
      for (int n = 0; n <= 40; ++n) so_far += swept.each_mm3[static_cast<std::size_t>(n)];
      EXPECT_NEAR(so_far, swept.total_mm3, 1e-9);
      EXPECT_EQ(swept.each_mm3[0], 0);
    }
  }
}

TEST(SweptVolume, OfAPoseWithinOneBeforeIsNothing) {
  const plan::Bit bit{3, 5, 50};
  const std::vector<BitPose> poses{{{0, 0, 9}, {0, 0, 1}}, {{0, 0, 8}, {0, 0, 1}}, {{0, 0, 9}, {0, 0, 1}}};
  const Swept swept = sweptVolume(bit, poses, 0);
  EXPECT_GT(swept.each_mm3[0], 30);
  EXPECT_EQ(swept.each_mm3[1], 0);
  EXPECT_EQ(swept.each_mm3[2], 0);
}

TEST(SweptVolume, OfATiltedBitInsideIsTheBitsOwn) {
  // All of a short bit lies below the plane: its volume, whichever way it is turned.
  const plan::Bit bit{2, 1.5, 6};
  const double own = kPi * 1.5 / 3 + kPi * 4.5;
  for (const double tilt_deg : {0.0, 2.0, 40.0, 75.0}) {
    const SinCos tilt = sinCos(tilt_deg * kPi / 180);
    const std::vector<BitPose> pose{{{0.2, -0.1, 9}, {0.6 * tilt.sin, 0.8 * tilt.sin, tilt.cos}}};
    expectWithin(sweptVolume(bit, pose, 0, {.columns = 4000}), own, 3e-3);
  }
}

TEST(SweptVolume, OfABitMovedSidewaysIsItsSilhouetteTimesTheWay) {
  // 2 mm sideways in steps so short that the scallops between them hardly count: chords of 0.005 mm on a radius of 1 mm
  // leave 0.005^3 / 12 mm^2 a step, 4e-6 mm^2 in all.
  const plan::Bit bit{2, 1.5, 20};
  std::vector<BitPose> poses;
  for (int n = 0; n <= 400; ++n) poses.push_back({{-1 + 0.005 * n, 0, 6}, {0, 0, 1}});
  const double silhouette = 2 * (6 - 1.5) + 1.5;
  expectWithin(sweptVolume(bit, poses, 0, {.columns = 1000}), holeOf(bit, 6) + 2 * silhouette, 2e-3);
}

TEST(SweptVolume, IsWhatTryingPlacesAtRandomFindsInAHand) {
  // The predicate, which the columns do not use, at 200,000 places in a box around all of it.
  const plan::Bit bit{3, 5, 50};
  std::vector<BitPose> poses;
  for (std::uint64_t cycle = 0; cycle < 8000; cycle += 200) {
    const session::Input input = session::sceneInput(session::Scene::Hand, cycle);
    poses.push_back({input.tip_mm, normalized(input.axis + Vec3{0.2, 0, 0})});  // tilted by 11 degrees more
  }
  const Reach reach = reachOf(bit, poses, 0);
  const drill::BitShape shape = drill::shapeOf(bit);
  Random random(5);
  const int tried = 200'000;
  int found = 0;
  for (int n = 0; n < tried; ++n) {
    const Vec3 p{random.uniform(-reach.radius_mm, reach.radius_mm), random.uniform(-reach.radius_mm, reach.radius_mm),
                 random.uniform(0, reach.depth_mm)};
    found += std::any_of(poses.begin(), poses.end(),
                         [&](const BitPose& pose) { return drill::isInside(shape, pose.tip_mm, pose.axis, p); })
                 ? 1
                 : 0;
  }
  const double box = 4 * reach.radius_mm * reach.radius_mm * reach.depth_mm, share = static_cast<double>(found) / tried;
  const double deviation = std::sqrt(share * (1 - share) / tried) * box;
  const Swept swept = sweptVolume(bit, poses, 0);
  EXPECT_NEAR(swept.total_mm3, share * box, 4 * deviation);
  EXPECT_LT(swept.error_mm3, 0.2 * deviation);
}

TEST(SweptVolume, IsTheSameFromAnyNumberOfThreads) {
  const auto poses = upright(0.3, 0.1, 50);
  const Swept one = sweptVolume({}, poses, 0, {.columns = 200, .threads = 1});
  const Swept three = sweptVolume({}, poses, 0, {.columns = 200, .threads = 3});
  EXPECT_EQ(one.each_mm3, three.each_mm3);
  EXPECT_EQ(one.total_mm3, three.total_mm3);
}

TEST(SweptVolume, ReachHoldsEveryPlaceOfTheBitBelowThePlane) {
  const plan::Bit bit{3, 5, 50};
  Random random(11);
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3 axis = normalized({random.uniform(-1, 1), random.uniform(-1, 1), 1});
    const BitPose pose{{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-2, 9)}, axis};
    const Reach reach = reachOf(bit, std::span(&pose, 1), 0);
    const Vec3 one = normalized(cross(axis, {1, 0, 0.3})), two = cross(axis, one);
    for (int n = 0; n < 500; ++n) {
      const double up = random.uniform(0, bit.length_mm), wide = 1.5 * std::min(1.0, up / bit.cone_length_mm);
      const SinCos around = sinCos(random.uniform(0, 2 * kPi));
      const Vec3 p = pose.tip_mm - axis * up + (one * around.cos + two * around.sin) * wide;
      if (p.z < 0) continue;
      ASSERT_LE(std::hypot(p.x, p.y), reach.radius_mm + 1e-12);
      ASSERT_LE(p.z, reach.depth_mm + 1e-12);
    }
  }
}

}  // namespace
}  // namespace spinaltap::tradeoff
