#include <gtest/gtest.h>

#include <cmath>

#include "core/base/random.h"
#include "core/phantom/phantom.h"

namespace spinaltap::phantom {
namespace {

/// A point of the surface near p, by stepping to the far side and halving; not by the code under test.
bool surfaceNear(const Phantom& phantom, const Vec3& p, const Vec3& direction, double reach, Vec3& out) {
  Vec3 a = p - direction * reach, b = p + direction * reach;
  const bool inside = phantom.signedDistance(a) < 0;
  if ((phantom.signedDistance(b) < 0) == inside) return false;
  for (int i = 0; i < 60; ++i) {
    const Vec3 middle = (a + b) * 0.5;
    ((phantom.signedDistance(middle) < 0) == inside ? a : b) = middle;
  }
  out = a;
  return true;
}

Vec3 randomDirection(Random& random) {
  for (;;) {
    const Vec3 d{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    if (dot(d, d) > 0.01 && dot(d, d) < 1) return normalized(d);
  }
}

TEST(PhantomDistance, IsThatToTheNearestOfThousandsOfSurfacePoints) {
  const auto phantom = Phantom::make({2, false});
  Random random(11);
  int probes = 0, missed = 0;
  while (probes < 60) {
    const Vec3 p =
        phantom.frame().toPatient({random.uniform(-50, 50), random.uniform(-22, 70), random.uniform(-29, 20)});
    const double found = phantom.distanceToSurface(p);
    if (std::fabs(found) > 1.5) continue;
    ++probes;
    double nearest = 1e9;
    for (int n = 0; n < 1500; ++n) {
      Vec3 q;
      const Vec3 start = p + randomDirection(random) * random.uniform(0.0, std::fabs(found) + 0.5);
      if (surfaceNear(phantom, start, randomDirection(random), 3.0, q)) nearest = std::min(nearest, norm(q - p));
    }
    EXPECT_EQ(found < 0, phantom.signedDistance(p) < 0);
    // Never longer than what brute force finds by more than the medial axis allows; never shorter than the truth.
    if (std::fabs(found) > nearest + 1e-6) ++missed;
    EXPECT_LT(std::fabs(found), nearest + 0.1);
    EXPECT_GT(std::fabs(found), nearest - 0.15) << "random surface points come within about that of the nearest";
  }
  EXPECT_LE(missed, 1);
}

TEST(PhantomDistance, IsZeroOnTheSurfaceAndGrowsAlongTheNormal) {
  const auto phantom = Phantom::make({6, false});
  Random random(12);
  int tried = 0;
  while (tried < 200) {
    const Vec3 p =
        phantom.frame().toPatient({random.uniform(-50, 50), random.uniform(-22, 70), random.uniform(-29, 20)});
    Vec3 q;
    if (!surfaceNear(phantom, p, randomDirection(random), 3.0, q)) continue;
    ++tried;
    EXPECT_NEAR(phantom.distanceToSurface(q), 0, 1e-9);
    // The smallest radius of curvature is about half a millimetre, so a tenth is safely nearest to its own foot.
    const Vec3 normal = normalized(phantom.gradient(q));
    EXPECT_NEAR(phantom.distanceToSurface(q + normal * 0.1), 0.1, 1e-6);
    EXPECT_NEAR(phantom.distanceToSurface(q - normal * 0.1), -0.1, 1e-6);
  }
}

TEST(PhantomDistance, TheImplicitIsCloseToItNearTheSurface) {
  const auto phantom = Phantom::make({1, false});
  Random random(13);
  double sum = 0;
  int count = 0;
  while (count < 2000) {
    const Vec3 p =
        phantom.frame().toPatient({random.uniform(-50, 50), random.uniform(-22, 70), random.uniform(-29, 20)});
    const double s = phantom.signedDistance(p);
    if (std::fabs(s) > 1) continue;
    const double d = phantom.distanceToSurface(p);
    EXPECT_LE(std::fabs(s), Phantom::kLipschitz * std::fabs(d) + 1e-9);
    sum += (s - d) * (s - d);
    ++count;
  }
  // Blended creases lie on a gentler slope (down to 0.45), so it is not the distance itself.
  EXPECT_LT(std::sqrt(sum / count), 0.2);
}

}  // namespace
}  // namespace spinaltap::phantom
