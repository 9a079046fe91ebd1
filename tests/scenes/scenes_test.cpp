#include "core/session/scenes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/scenes/bits.h"

namespace spinaltap::session {
namespace {

struct Golden {
  std::string scene, engine;
  int discs;
  std::uint64_t cycles, state_hash, removed;
};

const Golden kGolden[] = {
#include "golden_scenes.inc"
};

TEST(Scenes, EndInTheGoldenHashes) {
  for (const Golden& golden : kGolden) {
    if (golden.scene == "bits") {
      EXPECT_EQ(hashOfBits(), golden.state_hash);
      continue;
    }
    SCOPED_TRACE(golden.scene + " " + golden.engine + " " + std::to_string(golden.discs) + " discs");
    const auto result = runScene(*sceneNamed(golden.scene), golden.engine, golden.cycles, golden.discs);
    ASSERT_TRUE(result.has_value()) << result.error().message;
    EXPECT_EQ(result->state_hash, golden.state_hash);
    EXPECT_EQ(result->removed, golden.removed);
    EXPECT_EQ(result->cycles, golden.cycles);
  }
}

TEST(Scenes, UseTheReportsRealisticPath) {
  EXPECT_EQ(reportLattice().points(), 986958u);
  EXPECT_EQ(reportLattice().pointsPerDisc(), 2611u);
  EXPECT_NEAR(reportLattice().discs * reportLattice().spacing_mm, kReportLength_mm, 1e-12);
}

TEST(Scenes, FollowTheFormulasOfTheIssue) {
  // libm's long double sines beside our own; the tolerance is a few units in the last place of 0.1 mm.
  const long double pi = std::acos(-1.0L), w = 2 * pi * 9;
  for (const std::uint64_t cycle : {0ULL, 1ULL, 777ULL, 19999ULL, 20001ULL, 37800ULL}) {
    const long double t = static_cast<long double>(cycle) / 1000;
    const Input hand = sceneInput(Scene::Hand, cycle, -2.5);
    EXPECT_EQ(hand.t_us, cycle * 1000);
    EXPECT_NEAR(hand.tip_mm.x, static_cast<double>(0.10L * sinl(w * t) + 0.05L * sinl(1.7L * w * t + 1)), 1e-12);
    EXPECT_NEAR(hand.tip_mm.y, static_cast<double>(0.10L * cosl(0.83L * w * t) + 0.05L * sinl(0.31L * w * t)), 1e-12);
    EXPECT_NEAR(hand.tip_mm.z, static_cast<double>(t) - 2.5, 1e-12);
    const long double tilt = (2 * std::min(1.0L, t / 20) + 0.3L * sinl(0.9L * w * t)) * pi / 180;
    EXPECT_NEAR(hand.axis.x, static_cast<double>(sinl(tilt) * cosl(0.3L * t)), 1e-12);
    EXPECT_NEAR(hand.axis.y, static_cast<double>(sinl(tilt) * sinl(0.3L * t)), 1e-12);
    EXPECT_NEAR(hand.axis.z, static_cast<double>(cosl(tilt)), 1e-12);
  }
  EXPECT_EQ(sceneInput(Scene::On, 100).tip_mm, (Vec3{0, 0, 1.0}));
  EXPECT_EQ(sceneInput(Scene::Off, 100).tip_mm, (Vec3{1, 0, 1.0}));
  EXPECT_EQ(sceneInput(Scene::Off, 100).axis, (Vec3{0, 0, 1}));
}

TEST(Scenes, EndWithTheTipAtTheirLength) {
  for (const Scene scene : {Scene::On, Scene::Off, Scene::Hand}) {
    const std::uint64_t cycles = sceneCycles(scene, kReportLength_mm);
    EXPECT_NEAR(sceneInput(scene, cycles - 1, 1.5).tip_mm.z, 1.5 + kReportLength_mm, 1e-9);
  }
  EXPECT_EQ(sceneCycles(Scene::Hand, 37.8), 37801u);
  EXPECT_EQ(sceneCycles(Scene::On, 0), 1u);
  EXPECT_EQ(sceneCycles(Scene::On, 1e300), kMostSceneCycles);
}

TEST(Scenes, AreRefusedByNameWithTheNamesThereAre) {
  const auto result = sceneNamed("off the wall");
  ASSERT_FALSE(result.has_value());
  EXPECT_EQ(result.error().code, ErrorCode::NotFound);
  EXPECT_NE(result.error().message.find("on, off and hand"), std::string::npos);
  EXPECT_EQ(runScene(Scene::On, "steam", 1).error().code, ErrorCode::NotFound);
  EXPECT_EQ(runScene(Scene::On, "bounded", kMostSceneCycles + 1).error().code, ErrorCode::Limit);
  EXPECT_FALSE(runScene(Scene::On, "bounded", 1, 0).has_value());
}

}  // namespace
}  // namespace spinaltap::session
