// What the 2002 algorithm does and does not do, as core/drill/report.cpp says.
#include <gtest/gtest.h>

#include "core/base/dmath.h"
#include "core/drill/engine.h"

namespace spinaltap::drill {
namespace {

using point_volume::Lattice;
using point_volume::PointVolume;

const plan::Bit kBit{3.0, 5.0, 50.0};
const Vec3 kUp{0, 0, 1};

struct Pair {
  Pair() : a(*point_volume::solidVolume({0.1, 20, 60, 0}, 300)), b(a) {
    reference = *makeEngine("reference", a, kBit);
    report = *makeEngine("report", b, kBit);
  }
  void step(const BitPose& pose) { reference->step(a, pose), report->step(b, pose); }
  [[nodiscard]] std::uint64_t leftStanding() const { return countAlive(b) - countAlive(a); }
  /// No point that the reference kept.
  [[nodiscard]] bool removedTooMuch() const {
    for (std::size_t i = 0; i < a.alive.size(); ++i) {
      if ((a.alive[i] & ~b.alive[i]) != 0) return true;
    }
    return false;
  }

  PointVolume a, b;
  std::unique_ptr<Engine> reference, report;
};

TEST(Report, EqualsTheReferenceOnThePathInEveryCycle) {
  for (const double step_mm : {0.02, 0.03, 0.1}) {
    Pair pair;
    for (int i = 0; i * step_mm < 12; ++i) {
      pair.step({{0, 0, i * step_mm}, kUp});
      ASSERT_EQ(pair.a.alive, pair.b.alive) << "step " << step_mm << ", cycle " << i;
    }
    EXPECT_GT(pair.a.lattice.points() - countAlive(pair.a), 30000u);
  }
}

TEST(Report, LeavesBoneStandingWhenTheShaftMovesSideways) {
  Pair pair;
  for (int i = 0; i <= 240; ++i) pair.step({{0, 0, 0.05 * i}, kUp});  // the tip is out again at the far side
  ASSERT_EQ(pair.leftStanding(), 0u);
  for (int i = 0; i <= 50; ++i) pair.step({{0.01 * i, 0, 12}, kUp});
  EXPECT_GT(pair.leftStanding(), 5000u);
  EXPECT_FALSE(pair.removedTooMuch());
}

TEST(Report, LeavesBoneStandingWhereTheTiltedBitCutsARingTwice) {
  Pair pair;
  const SinCos tilt = sinCos(60 * kPi / 180);
  const Vec3 axis{tilt.sin, 0, tilt.cos};
  for (int i = 0; i <= 400; ++i) pair.step({axis * (0.05 * i - 5.0) + Vec3{0, 0, 3}, axis});
  EXPECT_GT(pair.leftStanding(), 1000u);
  EXPECT_FALSE(pair.removedTooMuch());
}

TEST(Report, LeavesTheShaftStandingWhenTheFirstPoseIsInsideTheBone) {
  Pair pair;
  pair.step({{0, 0, 5.9}, kUp});
  EXPECT_GT(pair.leftStanding(), 4000u);
  EXPECT_FALSE(pair.removedTooMuch());
}

TEST(Report, LeavesTheConesOuterRingsStandingWhenAStepIsLongerThanASpacing) {
  Pair pair;
  for (int i = 0; i <= 48; ++i) pair.step({{0, 0, 0.25 * i}, kUp});
  EXPECT_GT(pair.leftStanding(), 500u);
  EXPECT_FALSE(pair.removedTooMuch());
}

TEST(Report, EqualsTheReferenceBesideThePathOnlyWhileTheBitStaysUpright) {
  // A bit that is upright and moves only along the path cuts each ring once, with its tip: the two agree off the path.
  Pair pair;
  for (int i = 0; i <= 400; ++i) {
    pair.step({{1, 0, 0.025 * i}, kUp});
    ASSERT_EQ(pair.leftStanding(), 0u) << i;
  }
}

}  // namespace
}  // namespace spinaltap::drill
