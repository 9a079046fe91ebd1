#include <gtest/gtest.h>

#include <cmath>

#include "core/base/dmath.h"
#include "core/phantom/phantom.h"

namespace spinaltap::phantom {
namespace {

constexpr std::uint64_t kSeeds = 20;
constexpr double kBitRadius = 1.5;

template <class Check>
void forEveryPath(const Check& check) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const auto phantom = Phantom::make({seed, false});
    for (const Side side : {Side::Left, Side::Right}) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << (side == Side::Left ? " left" : " right"));
      check(phantom, phantom.pedicle(side), side);
    }
  }
}

TEST(PhantomPedicle, PathsStartOnTheSurfaceAndRunForwardAndInwardFromTheBack) {
  forEveryPath([](const Phantom& phantom, const PediclePath& path, Side side) {
    EXPECT_NEAR(phantom.signedDistance(path.entry_patient), 0, 1e-9);
    const Frame& frame = phantom.frame();
    const Vec3 entry = frame.toLocal(path.entry_patient), target = frame.toLocal(path.target_patient);
    const double outward = side == Side::Left ? 1 : -1;
    EXPECT_GT(entry.y, 30);
    EXPECT_LT(target.y, 0);
    EXPECT_GT(outward * entry.x, outward * target.x);
    EXPECT_GT(outward * target.x, 4) << "it stays on its own side";
    const double length = norm(path.target_patient - path.entry_patient);
    EXPECT_GT(length, 40);
    EXPECT_LT(length, 50) << "a bit of 50 mm reaches the target";
    // Nothing stands in the drill's way behind the entry.
    const Vec3 back = normalized(path.entry_patient - path.target_patient);
    for (double t = 0.5; t < 60; t += 0.5) EXPECT_GT(phantom.signedDistance(path.entry_patient + back * t), 0) << t;
  });
}

TEST(PhantomPedicle, ABitOfThreeMillimetresNeverBreaksOutOnTheWay) {
  forEveryPath([](const Phantom& phantom, const PediclePath& path, Side) {
    const Vec3 ahead = normalized(path.target_patient - path.entry_patient);
    const Vec3 side = normalized(cross(ahead, {0, 0, 1})), up = cross(side, ahead);
    const double length = norm(path.target_patient - path.entry_patient);
    // Past the slanted entry, the whole rim of the bit is at least a cortex away from the surface.
    for (double t = 5; t <= length; t += 0.5) {
      for (int n = 0; n < 24; ++n) {
        const SinCos turn = sinCosOfTurn(n, 24);
        const Vec3 rim = path.entry_patient + ahead * t + (side * turn.cos + up * turn.sin) * kBitRadius;
        EXPECT_LT(phantom.signedDistance(rim), -1.0) << "at " << t << " mm, direction " << n;
      }
    }
  });
}

TEST(PhantomPedicle, HasTheSizeOfAnL3sPedicle) {
  forEveryPath([](const Phantom&, const PediclePath& path, Side) {
    // Zindrick 1987, L3: width 10.3 mm, height 14.4 mm on average; about 8-13 and 12-17 are usual.
    EXPECT_GT(path.width_mm, 8);
    EXPECT_LT(path.width_mm, 13);
    EXPECT_GT(path.height_mm, 12);
    EXPECT_LT(path.height_mm, 17);
  });
}

TEST(PhantomPedicle, TheTargetLiesAtFourFifthsOfTheBody) {
  forEveryPath([](const Phantom& phantom, const PediclePath& path, Side) {
    const Vec3 ahead = normalized(path.target_patient - path.entry_patient);
    double rest = 0;
    while (phantom.signedDistance(path.target_patient + ahead * rest) < 0) rest += 0.01;
    // A body about 26-36 mm deep on that line: a fifth of it.
    EXPECT_GT(rest, 4.5);
    EXPECT_LT(rest, 7.5);
  });
}

}  // namespace
}  // namespace spinaltap::phantom
