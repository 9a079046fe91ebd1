#include <gtest/gtest.h>

#include <cmath>

#include "core/base/random.h"
#include "core/phantom/phantom.h"

namespace spinaltap::phantom {
namespace {

Vec3 somewhere(Random& random) { return {random.uniform(-50, 50), random.uniform(-22, 70), random.uniform(-29, 20)}; }

TEST(PhantomTissue, BoneIsCancellousInsideACortex) {
  for (const bool osteoporotic : {false, true}) {
    const auto phantom = Phantom::make({1, osteoporotic});
    Random random(21);
    int deep = 0, shell = 0;
    for (int n = 0; n < 60000; ++n) {
      const Vec3 local = somewhere(random);
      const double s = boneDistance(phantom.anatomy(), local);
      if (s >= 0) continue;
      const double hu = phantom.trueHu(phantom.frame().toPatient(local));
      const double thickness = phantom.tissue().shellThickness(local);
      if (-s > thickness + 0.21) {
        ++deep;
        EXPECT_GE(hu, osteoporotic ? 60 : 140);
        EXPECT_LE(hu, osteoporotic ? 90 : 230);
      } else if (-s < thickness - 0.21) {
        ++shell;
        EXPECT_GE(hu, 600);
        EXPECT_LE(hu, 1200);
      }
    }
    EXPECT_GT(deep, 1000);
    EXPECT_GT(shell, 100);
  }
}

TEST(PhantomTissue, TheShellIsAsThickAsItSays) {
  for (const bool osteoporotic : {false, true}) {
    const auto phantom = Phantom::make({2, osteoporotic});
    // The front wall of the body, where the implicit is a distance: walk inwards until half of the cortex is gone.
    const auto thicknessAt = [&](Vec3 local, const Vec3& inwards) {
      while (boneDistance(phantom.anatomy(), local) > 0) local += inwards * 0.001;
      double t = 0;
      const double half = osteoporotic ? 400 : 500;
      while (phantom.trueHu(phantom.frame().toPatient(local + inwards * t)) > half) t += 0.001;
      return t;
    };
    const double front = thicknessAt({0, -30, 0}, {0, 1, 0}), side = thicknessAt({-35, -3, 0}, {1, 0, 0});
    const double expected = osteoporotic ? 0.5 : 1.0;
    // The implicit's slope there is within a tenth of 1 (distance_test), and the edge is 0.4 mm soft.
    EXPECT_NEAR(front, expected, 0.15 + 0.1 * expected);
    EXPECT_NEAR(side, expected, 0.15 + 0.1 * expected);
    const Vec3 isthmus = phantom.frame().toLocal(phantom.pedicle(Side::Left).isthmus_patient);
    const double pedicle = thicknessAt(isthmus + Vec3{30, 0, 0}, {-1, 0, 0});
    EXPECT_GT(pedicle, 1.2 * expected) << "pedicle walls are thicker than the body's";
  }
}

TEST(PhantomTissue, CancellousBoneIsDenserNearTheEndplates) {
  const auto phantom = Phantom::make({3, false});
  const auto mean = [&](double z) {
    double sum = 0;
    int count = 0;
    for (double x = -12; x <= 12; x += 0.7) {
      for (double y = -8; y <= 8; y += 0.7, ++count) sum += phantom.trueHu(phantom.frame().toPatient({x, y, z}));
    }
    return sum / count;
  };
  EXPECT_GT(mean(9), mean(0) + 15);
  EXPECT_GT(mean(-9), mean(0) + 15);
}

TEST(PhantomTissue, TheSurroundingsAreCanalDiscMuscleFatAndAir) {
  const auto phantom = Phantom::make({4, false});
  const auto at = [&](const Vec3& local) { return phantom.trueHu(phantom.frame().toPatient(local)); };
  EXPECT_NEAR(at({0, 23, -10}), 30, 6);
  EXPECT_NEAR(at({0, 0, 19}), 80, 6);
  EXPECT_NEAR(at({0, 0, -19}), 80, 6);
  EXPECT_NEAR(at({38, 9, -3}), 54, 6);
  EXPECT_EQ(at({0, 120, 0}), -1000);
  Random random(5);
  int fat = 0, soft = 0;
  for (int n = 0; n < 20000; ++n) {
    const Vec3 local{random.uniform(-80, 80), random.uniform(-60, 80), random.uniform(-25, 18)};
    if (boneDistance(phantom.anatomy(), local) <= 0) continue;
    const double hu = at(local);
    EXPECT_TRUE(hu == -1000 || (hu >= -105 && hu <= 90)) << hu;
    fat += hu > -105 && hu < -85 ? 1 : 0;
    soft += hu >= 35 && hu <= 65 ? 1 : 0;
  }
  EXPECT_GT(fat, 1000);
  EXPECT_GT(soft, 5000);
}

}  // namespace
}  // namespace spinaltap::phantom
