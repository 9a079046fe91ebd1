#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>

#include "core/point_volume/point_volume.h"
#include "tests/core/point_volume/random_place.h"

namespace spinaltap::point_volume {
namespace {

/// A capsule: an exact distance, so its Lipschitz constant is 1.
struct Capsule {
  Vec3 a, b;
  double radius_mm = 1;
  [[nodiscard]] double operator()(const Vec3& p) const {
    const Vec3 ab = b - a;
    const double t = std::min(1.0, std::max(0.0, dot(p - a, ab) / dot(ab, ab)));
    return norm(p - a - ab * t) - radius_mm;
  }
};

struct Scene : Place {
  Capsule capsule;
};

Scene randomScene(std::uint64_t seed) {
  Random random(seed);
  Scene scene{randomPlace(random, 0.08, 0.6, 30, 60), {}};
  const auto near = [&] { return Vec3{random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 12)}; };
  scene.capsule = {scene.frame.toPatient(near()), scene.frame.toPatient(near()), random.uniform(0.2, 4)};
  return scene;
}

Field fieldOf(const Capsule& capsule, double lipschitz, std::uint64_t* evaluated = nullptr) {
  Field field;
  field.lipschitz = lipschitz;
  field.values = [capsule, evaluated](std::span<const Vec3> points, std::span<double> out) {
    ASSERT_EQ(points.size(), out.size());
    for (std::size_t i = 0; i < points.size(); ++i) out[i] = capsule(points[i]);
    if (evaluated != nullptr) *evaluated += points.size();
  };
  return field;
}

double huAt(const Vec3& p) { return 200 + 150 * std::sin(p.x) + 40 * p.y; }

void sampleHu(std::span<const Vec3> points, std::span<double> out) {
  for (std::size_t i = 0; i < points.size(); ++i) out[i] = huAt(points[i]);
}

/// Every point, one by one.
PointVolume bruteForce(const Scene& scene) {
  PointVolume volume = *solidVolume(scene.lattice, 0);
  const DiscTable table = discTable(scene.lattice);
  for (std::uint32_t i = 0; i < scene.lattice.points(); ++i) {
    const std::uint32_t rest = i % scene.lattice.pointsPerDisc();
    const double z = scene.lattice.discZ_mm(static_cast<int>(i / scene.lattice.pointsPerDisc()));
    const Vec3 p = scene.frame.toPatient({table.x_mm[rest], table.y_mm[rest], z});
    if (scene.capsule(p) < 0) {
      volume.density_mg_cm3[i] = densityFromHu(huAt(p));
    } else {
      volume.alive[i >> 6] &= ~(std::uint64_t{1} << (i & 63));
    }
  }
  return volume;
}

TEST(BuildVolume, EqualsEvaluatingEveryPoint) {
  std::uint64_t alive = 0, all = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Scene scene = randomScene(seed);
    const PointVolume expected = bruteForce(scene);
    for (const double lipschitz : {1.0, 1.7, std::numeric_limits<double>::infinity()}) {
      const auto built = buildVolume(scene.lattice, scene.frame, fieldOf(scene.capsule, lipschitz), sampleHu);
      ASSERT_TRUE(built.has_value());
      ASSERT_EQ(built->alive, expected.alive);
      ASSERT_EQ(built->density_mg_cm3, expected.density_mg_cm3);
    }
    alive += countAlive(expected), all += scene.lattice.points();
  }
  EXPECT_GT(alive, all / 20);  // the cases hold bone, and more than bone
  EXPECT_LT(alive, all - all / 20);
}

TEST(BuildVolume, EvaluatesFewPointsWhereTheBoundDecides) {
  const Lattice lattice{0.1, 30, 378, 0};
  const Capsule slab{{0, 0, -100}, {0, 0, 20}, 2.0};
  std::uint64_t evaluated = 0;
  const auto built = buildVolume(lattice, Frame{}, fieldOf(slab, 1.0, &evaluated), sampleHu);
  ASSERT_TRUE(built.has_value());
  EXPECT_GT(countAlive(*built), 200000u);
  EXPECT_LT(evaluated, lattice.points() / 4);
  RecordProperty("evaluated", static_cast<int>(evaluated));
}

TEST(BuildVolume, LeavesPointsDeadWhereTheFieldIsNotANumber) {
  const Lattice lattice{0.5, 5, 10, 0};
  for (const double lipschitz : {1.0, std::numeric_limits<double>::infinity()}) {
    Field field;
    field.lipschitz = lipschitz;
    field.values = [](std::span<const Vec3>, std::span<double> out) {
      for (double& v : out) v = std::numeric_limits<double>::quiet_NaN();
    };
    const auto built = buildVolume(lattice, Frame{}, field, sampleHu);
    ASSERT_TRUE(built.has_value());
    EXPECT_EQ(countAlive(*built), 0u);
  }
}

TEST(BuildVolume, RefusesALatticeThatIsNone) {
  EXPECT_FALSE(buildVolume({0.1, 0, 1, 0}, Frame{}, fieldOf({{}, {0, 0, 1}, 1}, 1.0), sampleHu).has_value());
}

TEST(SolidVolume, HasEveryPointAliveAndNoBitPastTheEnd) {
  for (const int discs : {1, 63, 64, 65}) {
    const auto volume = solidVolume({0.1, 1, discs, 0}, 300);
    ASSERT_TRUE(volume.has_value());
    EXPECT_EQ(countAlive(*volume), volume->lattice.points());
    EXPECT_EQ(volume->alive.size(), (volume->lattice.points() + 63) / 64);
    EXPECT_TRUE(volume->isAlive(static_cast<std::uint32_t>(discs - 1)));
  }
  EXPECT_FALSE(solidVolume({0.1, 0, 1, 0}, 300).has_value());
}

TEST(DensityFromHu, FollowsTheStatedRelationAndIsClamped) {
  EXPECT_EQ(densityFromHu(0), 47);
  EXPECT_EQ(densityFromHu(200), 271);  // 47 + 224.4
  EXPECT_EQ(densityFromHu(1200), 1393);
  EXPECT_EQ(densityFromHu(-1000), 0);
  EXPECT_EQ(densityFromHu(1e9), 65535);
  EXPECT_EQ(densityFromHu(std::numeric_limits<double>::infinity()), 65535);
  EXPECT_EQ(densityFromHu(-std::numeric_limits<double>::infinity()), 0);
  EXPECT_EQ(densityFromHu(std::numeric_limits<double>::quiet_NaN()), 0);
}

}  // namespace
}  // namespace spinaltap::point_volume
