#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "core/base/random.h"
#include "core/phantom/phantom.h"

namespace spinaltap::phantom {
namespace {

Vec3 anywhere(Random& random) { return {random.uniform(-60, 60), random.uniform(-35, 85), random.uniform(-40, 35)}; }

/// Distance from `from` to where s changes sign along `direction`, within 80 mm; -1 if it does not.
double firstChange(const Anatomy& an, const Vec3& from, const Vec3& direction) {
  const bool inside = boneDistance(an, from) < 0;
  for (double t = 0.05; t < 80; t += 0.05) {
    if ((boneDistance(an, from + direction * t) < 0) != inside) return t;
  }
  return -1;
}

/// Bone sampled every `step` mm in the vertebra's own frame.
struct Lattice {
  static constexpr int kNx = 104, kNy = 104, kNz = 60;
  std::vector<char> bone = std::vector<char>(static_cast<std::size_t>(kNx) * kNy * kNz);

  explicit Lattice(const Anatomy& an) {
    for (int k = 0; k < kNz; ++k)
      for (int j = 0; j < kNy; ++j)
        for (int i = 0; i < kNx; ++i) bone[at(i, j, k)] = boneDistance(an, place(i, j, k)) < 0 ? 1 : 0;
  }
  static Vec3 place(int i, int j, int k) { return {i - 51.5, j - 27.5, k - 33.5}; }
  static std::size_t at(int i, int j, int k) {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(kNx) *
               (static_cast<std::size_t>(j) + static_cast<std::size_t>(kNy) * static_cast<std::size_t>(k));
  }
  [[nodiscard]] std::size_t count(char value) const {
    std::size_t n = 0;
    for (const char c : bone) n += c == value ? 1 : 0;
    return n;
  }
  /// Voxels of the same kind that hang together by faces with (i, j, k).
  [[nodiscard]] std::size_t connected(int i0, int j0, int k0) const {
    std::vector<char> seen(bone.size());
    struct Voxel {
      int i, j, k;
    };
    std::vector<Voxel> todo{{i0, j0, k0}};
    seen[at(i0, j0, k0)] = 1;
    std::size_t n = 0;
    while (!todo.empty()) {
      const Voxel v = todo.back();
      todo.pop_back();
      ++n;
      constexpr int kSteps[6][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
      for (const auto& d : kSteps) {
        const Voxel w{v.i + d[0], v.j + d[1], v.k + d[2]};
        if (w.i < 0 || w.j < 0 || w.k < 0 || w.i >= kNx || w.j >= kNy || w.k >= kNz) continue;
        if (seen[at(w.i, w.j, w.k)] != 0 || bone[at(w.i, w.j, w.k)] != bone[at(i0, j0, k0)]) continue;
        seen[at(w.i, w.j, w.k)] = 1;
        todo.push_back(w);
      }
    }
    return n;
  }
};

TEST(PhantomShape, HasTheSameBitsForTheSameSeedAndOthersForAnother) {
  const auto one = Phantom::make({7, false}), same = Phantom::make({7, false}), other = Phantom::make({8, false});
  Random random(1);
  int different = 0;
  for (int n = 0; n < 200; ++n) {
    const Vec3 p = one.frame().toPatient(anywhere(random));
    EXPECT_EQ(bitsOf(one.signedDistance(p)), bitsOf(same.signedDistance(p)));
    different += one.signedDistance(p) != other.signedDistance(p) ? 1 : 0;
  }
  EXPECT_EQ(different, 200);
}

TEST(PhantomShape, IsNotChangedByBeingOsteoporotic) {
  const auto strong = Phantom::make({3, false}), weak = Phantom::make({3, true});
  Random random(2);
  for (int n = 0; n < 100; ++n) {
    const Vec3 p = strong.frame().toPatient(anywhere(random));
    EXPECT_EQ(strong.signedDistance(p), weak.signedDistance(p));
  }
}

TEST(PhantomShape, SkippingFarPartsNeverChangesAValue) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Anatomy an = Anatomy::make(seed);
    Random random(seed);
    for (int n = 0; n < 5000; ++n) {
      const Vec3 p = anywhere(random);
      ASSERT_EQ(boneDistance(an, p), boneDistanceUnskipped(an, p)) << "seed " << seed << " point " << n;
    }
  }
}

TEST(PhantomShape, ItsSlopeNeverExceedsTheStatedBound) {
  double steepest = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Anatomy an = Anatomy::make(seed);
    Random random(seed + 100);
    Vec3 steep_place;
    double steep = 0;
    for (int n = 0; n < 9000; ++n) {
      // A third anywhere near the bone, a third anywhere in the scanner, and a third climbing from the steepest so far.
      Vec3 a = anywhere(random);
      if (n % 3 == 1) a *= 4.0;
      if (n % 3 == 2) a = steep_place + (anywhere(random) - anywhere(random)) * 0.02;
      // Steps from a hundredth of a millimetre, where the steepest place shows, to several millimetres.
      const double reach = 0.01 * std::pow(10.0, random.uniform(0.0, 2.7));
      const Vec3 b = a + Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)} * reach;
      const double slope = std::fabs(boneDistance(an, a) - boneDistance(an, b)) / norm(a - b);
      if (slope > steep) steep = slope, steep_place = a;
      ASSERT_LE(slope, Phantom::kLipschitz) << "seed " << seed << " point " << n;
    }
    steepest = std::max(steepest, steep);
  }
  EXPECT_GT(steepest, 1.1) << "a bound that is never approached wastes every cull made with it";
}

TEST(PhantomShape, GradientsAreFiniteEverywhereAndPointOutOfBone) {
  const auto phantom = Phantom::make({4, false});
  const Field field = phantom.field();
  Random random(4);
  std::vector<Vec3> points;
  for (int n = 0; n < 4000; ++n) points.push_back(phantom.frame().toPatient(anywhere(random)));
  points.push_back(phantom.frame().origin_patient);
  std::vector<Vec3> gradients(points.size());
  std::vector<double> values(points.size());
  field.gradients(points, gradients);
  field.values(points, values);
  for (std::size_t n = 0; n < points.size(); ++n) {
    ASSERT_TRUE(isFinite(gradients[n])) << n;
    if (std::fabs(values[n]) > 1) continue;
    EXPECT_GT(norm(gradients[n]), 0.35) << n;
    const Vec3 step = normalized(gradients[n]) * 1e-3;
    EXPECT_GT(phantom.signedDistance(points[n] + step), phantom.signedDistance(points[n] - step)) << n;
  }
}

TEST(PhantomShape, IsOnePieceWithoutHiddenHollows) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Lattice lattice(Anatomy::make(seed));
    EXPECT_EQ(lattice.connected(51, 27, 33), lattice.count(1)) << "seed " << seed;
    EXPECT_EQ(lattice.connected(0, 0, 0), lattice.count(0)) << "seed " << seed;
    // L3 of the three labelled scans in the shared data: 52 to 58 cm^3; adults span more.
    EXPECT_GT(lattice.count(1), 42000u);
    EXPECT_LT(lattice.count(1), 68000u);
  }
}

TEST(PhantomShape, TheCanalIsOpenAboveAndBelowAndClosedAllRound) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Anatomy an = Anatomy::make(seed);
    const double middle = 0.5 * (an.rim_half_depth + an.canal_apex_y) - 1;
    for (double z = -40; z <= 40; z += 0.5) {
      EXPECT_GT(boneDistance(an, {0, middle, z}), 3.0) << "seed " << seed << " z " << z;
    }
    // At the pedicles' lower half the ring of bone is complete.
    const Vec3 centre{0, middle, -5};  // below the basivertebral opening
    const double front = firstChange(an, centre, {0, -1, 0}), back = firstChange(an, centre, {0, 1, 0});
    const double left = firstChange(an, {0, 20.5, 3}, {1, 0, 0}), right = firstChange(an, {0, 20.5, 3}, {-1, 0, 0});
    // Panjabi 1992, L3: canal 24 mm wide, 17 mm deep, each with a spread of a few millimetres.
    EXPECT_GT(left + right, 20.0) << seed;
    EXPECT_LT(left + right, 26.0) << seed;
    EXPECT_GT(front + back, 13.5) << seed;
    EXPECT_LT(front + back, 20.0) << seed;
  }
}

TEST(PhantomShape, HasTheDimensionsOfAnL3) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Anatomy an = Anatomy::make(seed);
    const auto across = [&](const Vec3& from, const Vec3& direction) {
      return firstChange(an, from, direction) + firstChange(an, from, -direction);
    };
    const double waist = across({0, 0, 0}, {1, 0, 0}), depth = across({0, -1, 1.0}, {0, 1, 0});
    const double height = across({0, 12, 0}, {0, 0, 1}), middle_height = across({0, 0, 0}, {0, 0, 1});
    EXPECT_GT(waist, 38) << seed;
    EXPECT_LT(waist, 48) << seed;
    EXPECT_GT(depth, 28) << seed;
    EXPECT_LT(depth, 37) << seed;
    EXPECT_GT(height, 25) << seed;
    EXPECT_LT(height, 31) << seed;
    EXPECT_LT(middle_height, height - 1.0) << "endplates are dished, seed " << seed;
    const double rim = across({0, 0, 11.5}, {1, 0, 0});
    EXPECT_GT(rim, waist + 1.5) << "the body is waisted, seed " << seed;
    // The back wall is concave: at the middle it lies farther forward than beside it.
    const auto wall = [&](double x) { return firstChange(an, {x, 5, -6}, {0, 1, 0}); };
    EXPECT_GT(0.5 * (wall(9) + wall(-9)), wall(0) + 0.3) << seed;
  }
}

TEST(PhantomShape, SidesAreAlikeButNotMirrored) {
  const Anatomy an = Anatomy::make(5);
  Random random(5);
  double most = 0;
  for (int n = 0; n < 3000; ++n) {
    const Vec3 p = anywhere(random);
    most = std::max(most, std::fabs(boneDistance(an, p) - boneDistance(an, {-p.x, p.y, p.z})));
  }
  // Each side is displaced by at most (0.42, 0.42, 0.47) mm, 0.76 mm long, at a slope of at most the bound.
  EXPECT_LE(most, 2 * 0.76 * Phantom::kLipschitz);
  EXPECT_GT(most, 0.1);
}

TEST(PhantomShape, BoundsHoldTheWholeBoneWithAMillimetreToSpare) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const auto phantom = Phantom::make({seed, false});
    const Bounds box = phantom.bounds();
    const Vec3 low = box.low_patient + Vec3{1, 1, 1}, high = box.high_patient - Vec3{1, 1, 1};
    const Vec3 size = high - low;
    for (int a = 0; a <= 100; ++a) {
      for (int b = 0; b <= 100; ++b) {
        const double u = a / 100.0, v = b / 100.0;
        for (const double side : {0.0, 1.0}) {
          // If bone crossed a face of this box it would be found there; the faces are sampled about every millimetre.
          ASSERT_GT(phantom.signedDistance(low + Vec3{side * size.x, u * size.y, v * size.z}), 0);
          ASSERT_GT(phantom.signedDistance(low + Vec3{u * size.x, side * size.y, v * size.z}), 0);
          ASSERT_GT(phantom.signedDistance(low + Vec3{u * size.x, v * size.y, side * size.z}), 0);
        }
      }
    }
    EXPECT_LT(phantom.signedDistance(phantom.seedPoint()), -8);
  }
}

}  // namespace
}  // namespace spinaltap::phantom
