#include "core/drill/engine.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/dmath.h"
#include "core/base/random.h"
#include "core/drill/predicate.h"

namespace spinaltap::drill {
namespace {

using point_volume::Lattice;
using point_volume::PointVolume;

plan::Bit randomBit(Random& random) {
  plan::Bit bit;
  bit.diameter_mm = random.uniform(0.5, 8);
  if (random.below(4) == 0) bit.diameter_mm = 0.1 * static_cast<double>(5 + random.below(70));  // grazes rings
  bit.length_mm = random.uniform(1, 60);
  bit.cone_length_mm = random.below(4) == 0 ? 0.0 : random.uniform(0, bit.length_mm);
  return bit;
}

Lattice randomLattice(Random& random) {
  static constexpr double kSpacings[] = {0.5, 0.25, 0.2, 0.1, 0.05};
  Lattice lattice;
  lattice.spacing_mm = kSpacings[random.below(5)];
  lattice.rings = 1 + static_cast<int>(random.below(45));
  const std::uint64_t most = 1 + 80000 / lattice.pointsPerDisc();
  lattice.discs = 1 + static_cast<int>(random.below(std::min<std::uint64_t>(most, 200)));
  lattice.first_disc = static_cast<int>(random.below(40)) - 20;
  return lattice;
}

Vec3 direction(double tilt_rad, double azimuth_rad) {
  const SinCos tilt = sinCos(tilt_rad), azimuth = sinCos(azimuth_rad);
  return {tilt.sin * azimuth.cos, tilt.sin * azimuth.sin, tilt.cos};
}

/// Anything a hand may do, and what it may not: upright on a lattice point, backwards, flat, outside.
BitPose randomPose(Random& random, const Lattice& lattice) {
  const double wide = lattice.rings * lattice.spacing_mm, z0 = lattice.discZ_mm(0);
  const double z1 = lattice.discZ_mm(lattice.discs - 1);
  BitPose pose;
  pose.tip_mm = {random.uniform(-wide, wide), random.uniform(-wide, wide), random.uniform(z0 - 1, z1 + 5)};
  static constexpr double kTilts[] = {0, 2, 10, 45, 89, 90, 91, 178, 180};
  const double tilt_deg = kTilts[random.below(9)] + (random.below(2) == 0 ? 0.0 : random.uniform(-1, 1));
  pose.axis = direction(tilt_deg * kPi / 180, random.uniform(0, 2 * kPi));
  if (random.below(5) == 0) pose = {{0, 0, lattice.discZ_mm(static_cast<int>(random.below(80)))}, {0, 0, 1}};
  if (random.below(12) == 0) pose.tip_mm += direction(random.uniform(0, kPi), random.uniform(0, 6)) * 1000.0;
  return pose;
}

void moveOn(Random& random, BitPose& pose) {
  const double step = std::ldexp(1.0, -static_cast<int>(random.below(20)));
  pose.tip_mm += direction(random.uniform(0, kPi), random.uniform(0, 6)) * step;
  pose.axis = normalized(pose.axis + direction(random.uniform(0, kPi), random.uniform(0, 6)) * (0.1 * step));
}

struct Step {
  Removal removal;
  std::vector<std::uint32_t> indices;  // ascending
};

Step stepOf(Engine& engine, PointVolume& volume, const BitPose& pose) {
  Step step;
  step.removal = engine.step(volume, pose, [&](std::span<const std::uint32_t> some) {
    step.indices.insert(step.indices.end(), some.begin(), some.end());
  });
  std::sort(step.indices.begin(), step.indices.end());
  return step;
}

/// The first point in which two volumes differ, or nothing.
std::string difference(const PointVolume& a, const PointVolume& b) {
  for (std::uint32_t word = 0; word < a.alive.size(); ++word) {
    const std::uint64_t bits = a.alive[word] ^ b.alive[word];
    if (bits == 0) continue;
    const point_volume::Site site = a.lattice.site((word << 6) + static_cast<std::uint32_t>(__builtin_ctzll(bits)));
    return "disc " + std::to_string(site.disc) + ", ring " + std::to_string(site.ring) + ", slot " +
           std::to_string(site.slot);
  }
  return "";
}

void expectSame(const Step& ours, const Step& truth) {
  ASSERT_EQ(ours.removal.count, truth.removal.count);
  ASSERT_EQ(ours.removal.density_sum_mg_cm3, truth.removal.density_sum_mg_cm3);
  ASSERT_EQ(ours.removal.hash_delta, truth.removal.hash_delta);
  ASSERT_EQ(ours.indices, truth.indices);
}

/// All alive, or full of holes and slots of bone, as a vertebra's rim leaves it.
PointVolume randomVolume(Random& random, const Lattice& lattice) {
  PointVolume volume = *point_volume::solidVolume(lattice, 300);
  for (auto& density : volume.density_mg_cm3) density = static_cast<std::uint16_t>(random.below(65536));
  if (random.below(3) != 0) return volume;
  const std::uint64_t rarity = 1 + random.below(6);
  for (std::uint32_t i = 0; i < lattice.points(); ++i) {
    const bool dead = random.below(2) == 0 ? random.below(rarity) == 0 : (i / 97) % (rarity + 1) == 0;
    if (dead) volume.alive[i >> 6] &= ~(std::uint64_t{1} << (i & 63));
  }
  return volume;
}

struct Kind {
  const char* label;
  const char* engine;
  EngineOptions options;
  std::uint64_t hands = 8;
};

class Exact : public testing::TestWithParam<Kind> {
 protected:
  static std::unique_ptr<Engine> reference(const PointVolume& volume, const plan::Bit& bit) {
    return *makeEngine("reference", volume, bit, {GetParam().options.precision, 1});
  }
  static std::unique_ptr<Engine> engine(const PointVolume& volume, const plan::Bit& bit) {
    return *makeEngine(GetParam().engine, volume, bit, GetParam().options);
  }
};

TEST_P(Exact, RemovesWhatTheReferenceRemovesForAnyBitLatticeAndMotion) {
  std::uint64_t removed = 0, cycles = 0;
  for (std::uint64_t seed = 1; seed <= 600; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const plan::Bit bit = randomBit(random);
    PointVolume a = randomVolume(random, randomLattice(random));
    PointVolume b = a;
    const auto truth_engine = reference(a, bit), our_engine = engine(b, bit);
    BitPose pose = randomPose(random, a.lattice);
    for (int i = 0; i < 12; ++i, ++cycles) {
      if (random.below(3) == 0) {
        pose = randomPose(random, a.lattice);
      } else {
        moveOn(random, pose);
      }
      const Step truth = stepOf(*truth_engine, a, pose);
      const Step ours = stepOf(*our_engine, b, pose);
      ASSERT_EQ(difference(a, b), "") << "cycle " << i;
      expectSame(ours, truth);
      if (HasFatalFailure()) return;
      removed += truth.removal.count;
    }
  }
  // The cases are worth something only if they cut.
  EXPECT_GT(removed, 1000000u);
  RecordProperty("cycles", static_cast<int>(cycles));
}

/// A hand: it trembles, turns, pushes, rests, pulls back and pushes again, and now and then samples are lost.
class Hand {
 public:
  Hand(Random& random, const Lattice& lattice) : random_(random), lattice_(lattice) {
    const double wide = 0.4 * lattice.rings * lattice.spacing_mm;
    tip_ = {random.uniform(-wide, wide), random.uniform(-wide, wide), lattice.discZ_mm(0) - 0.2};
    static constexpr double kTilts[] = {0, 0, 1, 2, 5, 12, 30, 58, 62, 85};
    tilt_deg_ = kTilts[random.below(10)];
    feed_mm_ = std::ldexp(0.02, -static_cast<int>(random.below(8)));
    tremor_mm_ = random.below(4) == 0 ? 0.0 : random.uniform(0, 0.2);
    azimuth_ = random.uniform(0, 2 * kPi);
  }
  BitPose next() {
    if (random_.below(200) == 0) feed_mm_ = -feed_mm_;
    if (random_.below(300) == 0) resting_ = !resting_;
    if (random_.below(400) == 0) t_ += 100;  // lost samples
    if (!resting_) t_ += 1, tip_ += direction(tilt_deg_ * kPi / 180, azimuth_) * feed_mm_;
    const double deep = lattice_.discZ_mm(lattice_.discs) + 1, high = lattice_.discZ_mm(0) - 1;
    if ((tip_.z > deep && feed_mm_ > 0) || (tip_.z < high && feed_mm_ < 0)) feed_mm_ = -feed_mm_;
    const SinCos a = sinCos(0.056 * t_), b = sinCos(0.096 * t_ + 1);
    const double tilt_deg = tilt_deg_ + 3 * tremor_mm_ * a.cos;
    return {tip_ + Vec3{a.sin, b.cos, 0.1 * b.sin} * tremor_mm_, direction(tilt_deg * kPi / 180, azimuth_ + 3e-4 * t_)};
  }

 private:
  Random& random_;
  const Lattice& lattice_;
  Vec3 tip_;
  double tilt_deg_ = 0, feed_mm_ = 0, tremor_mm_ = 0, azimuth_ = 0, t_ = 0;
  bool resting_ = false;
};

TEST_P(Exact, RemovesWhatTheReferenceRemovesInEveryCycleOfAHand) {
  std::uint64_t removed = 0, reached = 0;
  for (std::uint64_t seed = 1; seed <= GetParam().hands; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(1000 + seed);
    plan::Bit bit = randomBit(random);
    bit.diameter_mm = std::min(bit.diameter_mm, 4.0);
    static constexpr double kSpacings[] = {0.2, 0.15, 0.1, 0.1, 0.07};
    const double spacing = kSpacings[random.below(5)];
    const int rings = static_cast<int>((0.6 * bit.diameter_mm + random.uniform(0.2, 1.0)) / spacing) + 2;
    Lattice lattice{spacing, rings, 1, static_cast<int>(random.below(10)) - 5};
    lattice.discs = 2 + static_cast<int>(30000 / lattice.pointsPerDisc());
    PointVolume a = randomVolume(random, lattice);
    PointVolume b = a;
    const auto truth_engine = reference(a, bit), our_engine = engine(b, bit);
    Hand hand(random, lattice);
    for (int i = 0; i < 2000; ++i) {
      const BitPose pose = hand.next();
      const Removal truth = truth_engine->step(a, pose), ours = our_engine->step(b, pose);
      ASSERT_EQ(ours.count, truth.count) << "cycle " << i << ", " << difference(a, b);
      ASSERT_EQ(ours.hash_delta, truth.hash_delta) << "cycle " << i;
      ASSERT_EQ(ours.density_sum_mg_cm3, truth.density_sum_mg_cm3) << "cycle " << i;
      removed += truth.count, reached += truth.count != 0;
    }
    ASSERT_EQ(a.alive, b.alive);
  }
  EXPECT_GT(removed, 1000u * GetParam().hands);
  EXPECT_GT(reached, 20u * GetParam().hands);
}

TEST_P(Exact, RemovesWhatTheReferenceRemovesWhereTheConeMeetsTheShaft) {
  // Short cones and tilts, where the two ellipses of a section have far-off middles, and a disc that the bit meets just
  // where one gives way to the other, to some 1e-5 mm either way.
  std::uint64_t removed = 0;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(5000 + seed);
    plan::Bit bit{random.uniform(1, 5), 0, 20};
    bit.cone_length_mm = random.uniform(0.4, 2) * bit.diameter_mm;
    const Lattice lattice{0.1, 45, 3, -1};
    PointVolume a = *point_volume::solidVolume(lattice, 300), b = a;
    const auto truth_engine = reference(a, bit), our_engine = engine(b, bit);
    const double tilt = random.uniform(2, 20) * kPi / 180;
    double azimuth = random.uniform(0, 2 * kPi);
    for (int i = 0; i < 30; ++i, azimuth += random.uniform(0, 0.02)) {
      const Vec3 axis = direction(tilt, azimuth);
      // Section.h: the cone's ellipse reaches k c u / g, the shaft's R / u; here they are as wide as each other.
      const double k = bit.diameter_mm / 2 / bit.cone_length_mm, u = axis.z, g = u * u - k * k * (1 - u * u);
      const double c = bit.diameter_mm / 2 / u * g / (k * u) + random.uniform(-1e-4, 1e-4) / k;
      const double off = 0.02 * i;
      const BitPose pose{Vec3{off, 0.3 * off, 0} + Vec3{axis.x, axis.y, 0} * c + Vec3{0, 0, u * c}, axis};
      const Removal truth = truth_engine->step(a, pose), ours = our_engine->step(b, pose);
      ASSERT_EQ(difference(a, b), "") << "cycle " << i;
      ASSERT_EQ(ours.count, truth.count);
      removed += truth.count;
    }
  }
  EXPECT_GT(removed, 100000u);
}

TEST_P(Exact, RemovesWhatTheReferenceRemovesOfRingsAsWideAsABitJustOffThePath) {
  // So close to the path the direction of a section's middle is hardly known, and a ring as wide as the bit is torn
  // anywhere; some 1e-4 mm wider or narrower, just so.
  std::uint64_t removed = 0, torn = 0;
  for (std::uint64_t seed = 1; seed <= 500; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(9000 + seed);
    const Lattice lattice{0.02, 56, 4, static_cast<int>(random.below(60))};
    const double wider_mm = random.below(3) == 0 ? 0.0 : random.uniform(-2e-4, 2e-4);
    const plan::Bit bit{2 * (1.0 + wider_mm), 0.1, 60};
    PointVolume a = *point_volume::solidVolume(lattice, 300), b = a;
    const auto truth_engine = reference(a, bit), our_engine = engine(b, bit);
    for (int i = 0; i < 3; ++i) {
      const SinCos way = sinCos(random.uniform(0, 2 * kPi));
      const double tilt = random.below(2) == 0 ? 0.0 : random.uniform(0, 0.02);
      const Vec3 axis = direction(tilt, random.uniform(0, 2 * kPi));
      const double off = std::ldexp(random.uniform(1, 2), -7 - static_cast<int>(random.below(18)));
      const double along = random.uniform(5, 50);
      const Vec3 middle{off * way.cos, off * way.sin, lattice.discZ_mm(1)};
      const BitPose pose{middle + axis * along, axis};
      const Removal truth = truth_engine->step(a, pose), ours = our_engine->step(b, pose);
      ASSERT_EQ(difference(a, b), "") << "cycle " << i;
      ASSERT_EQ(ours.count, truth.count);
      ASSERT_EQ(ours.hash_delta, truth.hash_delta);
      removed += truth.count;
      torn += i == 0 && truth.count % lattice.discs != 0;
    }
  }
  EXPECT_GT(removed, 1000000u);
  EXPECT_GT(torn, 50u);
}

INSTANTIATE_TEST_SUITE_P(Engines, Exact,
                         testing::Values(Kind{"Bounded", "bounded", {}}, Kind{"Clearance", "clearance", {}, 40},
                                         Kind{"ClearanceOnTwoThreads", "clearance", {Precision::Double, 2}},
                                         Kind{"ClearanceInSingles", "clearance", {Precision::Single, 1}}),
                         [](const auto& kind) { return std::string(kind.param.label); });

TEST(Engines, SayWhichOptionsTheyHave) {
  const PointVolume volume = *point_volume::solidVolume({0.1, 4, 4, 0}, 300);
  const plan::Bit bit{1, 1, 5};
  EXPECT_EQ(makeEngine("bounded", volume, bit, {Precision::Single, 1}).error().code, ErrorCode::Unsupported);
  EXPECT_EQ(makeEngine("reference", volume, bit, {Precision::Double, 2}).error().code, ErrorCode::Unsupported);
  EXPECT_EQ(makeEngine("clearance", volume, bit, {Precision::Double, 3}).error().code, ErrorCode::Unsupported);
  EXPECT_EQ(makeEngine("steam", volume, bit).error().code, ErrorCode::NotFound);
}

}  // namespace
}  // namespace spinaltap::drill
