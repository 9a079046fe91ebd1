#include "core/point_volume/pieces.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "tests/core/point_volume/random_place.h"

namespace spinaltap::point_volume {
namespace {

/// A ball, whose values are off by up to `error_mm` in a way that depends on what is asked along with a point.
Field ballOf(const Vec3& middle, double radius_mm, double error_mm) {
  Field field;
  field.lipschitz = 1;
  field.error_mm = error_mm;
  field.exact = [middle, radius_mm](std::span<const Vec3> points, std::span<double> out) {
    for (std::size_t i = 0; i < points.size(); ++i) out[i] = norm(points[i] - middle) - radius_mm;
  };
  field.values = [exact = field.exact, error_mm](std::span<const Vec3> points, std::span<double> out) {
    exact(points, out);
    Random random(points.size());
    for (double& value : out) value += error_mm * random.uniform(-1, 1);
  };
  return field;
}

void hu(std::span<const Vec3> points, std::span<double> out) {
  for (std::size_t i = 0; i < points.size(); ++i) out[i] = 300 + 100 * std::sin(3 * points[i].z) + 20 * points[i].x;
}

struct Scene : Place {
  Field field;
};

Scene randomScene(std::uint64_t seed) {
  Random random(seed);
  Scene scene{randomPlace(random, 0.1, 0.4, 12, 50), {}};
  const Vec3 middle{random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 8)};
  scene.field = ballOf(scene.frame.toPatient(middle), random.uniform(0.5, 5), random.unit() < 0.5 ? 0.0 : 0.05);
  return scene;
}

PointVolume whole(const Scene& scene, unsigned threads = 1) {
  return buildVolume(scene.lattice, scene.frame, scene.field, hu, threads).value();
}

TEST(Pieces, InAnyOrderEqualTheWholeBitForBit) {
  std::uint64_t alive = 0, all = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Scene scene = randomScene(seed);
    Random random(1000 + seed);
    std::vector<int> cuts{0};
    while (cuts.back() < scene.lattice.discs) {
      cuts.push_back(std::min(scene.lattice.discs, cuts.back() + 1 + static_cast<int>(random.below(9))));
    }
    std::vector<std::size_t> order(cuts.size() - 1);
    for (std::size_t n = 0; n < order.size(); ++n) order[n] = n;
    for (std::size_t n = order.size(); n > 1; --n) std::swap(order[n - 1], order[random.below(n)]);
    PointVolume built = *emptyVolume(scene.lattice);
    for (const std::size_t n : order) {
      const auto piece = buildDiscs(scene.lattice, cuts[n], cuts[n + 1], scene.frame, scene.field, hu, 1);
      ASSERT_TRUE(piece.has_value());
      place(*piece, cuts[n], built);
    }
    const PointVolume expected = whole(scene);
    ASSERT_EQ(built.alive, expected.alive);
    ASSERT_EQ(built.density_mg_cm3, expected.density_mg_cm3);
    alive += countAlive(expected), all += scene.lattice.points();
  }
  EXPECT_GT(alive, all / 20);  // else the scenes say nothing
  EXPECT_LT(alive, all - all / 20);
}

TEST(Pieces, PutInPlaceReplaceTheirOwnDiscsAndTouchNoOther) {
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const Lattice lattice{0.1, 1 + static_cast<int>(random.below(6)), 1 + static_cast<int>(random.below(20)), 0};
    PointVolume volume = *emptyVolume(lattice);
    const auto scribble = [&](PointVolume& on) {
      for (std::uint32_t i = 0; i < on.lattice.points(); ++i) {
        on.density_mg_cm3[i] = static_cast<std::uint16_t>(random.below(65536));
        if (random.unit() < 0.5) on.alive[i >> 6] |= std::uint64_t{1} << (i & 63);
      }
    };
    scribble(volume);
    const PointVolume before = volume;
    const int begin = static_cast<int>(random.below(static_cast<std::uint64_t>(lattice.discs)));
    const int end = begin + 1 + static_cast<int>(random.below(static_cast<std::uint64_t>(lattice.discs - begin)));
    PointVolume piece = *emptyVolume(discsOf(lattice, begin, end));
    scribble(piece);
    place(piece, begin, volume);
    for (std::uint32_t i = 0; i < lattice.points(); ++i) {
      const int disc = lattice.site(i).disc;
      const bool own = disc >= begin && disc < end;
      const std::uint32_t there = i - static_cast<std::uint32_t>(begin) * lattice.pointsPerDisc();
      ASSERT_EQ(volume.isAlive(i), own ? piece.isAlive(there) : before.isAlive(i)) << i;
      ASSERT_EQ(volume.density_mg_cm3[i], own ? piece.density_mg_cm3[there] : before.density_mg_cm3[i]) << i;
    }
    EXPECT_EQ(volume.alive.size(), before.alive.size());
    if (lattice.points() % 64 != 0) {
      EXPECT_EQ(volume.alive.back() >> (lattice.points() % 64), 0u);
    }
  }
}

TEST(Pieces, OfALatticeLieWhereItsDiscsDo) {
  const Lattice lattice{0.1, 3, 40, -7};
  const Lattice part = discsOf(lattice, 11, 30);
  ASSERT_EQ(part.discs, 19);
  for (int disc = 0; disc < part.discs; ++disc) EXPECT_EQ(part.discZ_mm(disc), lattice.discZ_mm(11 + disc));
}

TEST(Pieces, AreRefusedWhereTheLatticeHasNoDiscs) {
  const Scene scene = randomScene(1);
  const int discs = scene.lattice.discs;
  for (const auto& [begin, end] : std::vector<std::pair<int, int>>{{-1, 1}, {0, discs + 1}, {0, 0}, {1, 0}}) {
    const auto piece = buildDiscs(scene.lattice, begin, end, scene.frame, scene.field, hu);
    ASSERT_FALSE(piece.has_value());
    EXPECT_EQ(piece.error().code, ErrorCode::InvalidArgument);
  }
  EXPECT_FALSE(emptyVolume({0.1, 0, 1, 0}).has_value());
}

TEST(BuildVolume, HasTheSameBitsFromAnyNumberOfThreads) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Scene scene = randomScene(seed);
    scene.lattice.discs = 200;  // several blocks of samples
    const PointVolume expected = whole(scene, 1);
    for (const unsigned threads : {2U, 3U, 0U}) {
      const PointVolume built = whole(scene, threads);
      ASSERT_EQ(built.alive, expected.alive) << "seed " << seed;
      ASSERT_EQ(built.density_mg_cm3, expected.density_mg_cm3) << "seed " << seed;
    }
  }
}

TEST(BuildVolume, AsksExactlyWhereTheFieldsErrorCouldTurnASign) {
  std::uint64_t wrong_without = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Scene scene = randomScene(seed);
    Field exact = scene.field;
    exact.values = exact.exact, exact.error_mm = 0, exact.lipschitz = std::numeric_limits<double>::infinity();
    const PointVolume expected = buildVolume(scene.lattice, scene.frame, exact, hu).value();
    ASSERT_EQ(whole(scene).alive, expected.alive);
    scene.field.exact = nullptr;
    wrong_without += whole(scene).alive != expected.alive ? 1 : 0;
  }
  EXPECT_GT(wrong_without, 10u);  // the errors are such as to show
}

}  // namespace
}  // namespace spinaltap::point_volume
