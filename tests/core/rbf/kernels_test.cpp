// The loops over vector lanes beside plain ones.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "core/rbf/chebyshev.h"
#include "core/rbf/dense_system.h"
#include "core/rbf/direct_sum.h"
#include "core/rbf/simd_dense.h"
#include "core/rbf/simd_sums.h"
#include "tests/core/rbf/sets.h"

namespace spinaltap::rbf {
namespace {

struct Pairs {
  std::vector<Vec3> targets, sources;
  std::vector<double> weights;
};

/// Some targets are sources, so that distances of 0 occur.
Pairs pairs(std::size_t targets, std::size_t sources, std::uint64_t seed) {
  Random random(seed);
  Pairs out;
  for (std::size_t j = 0; j < sources; ++j) {
    out.sources.push_back(randomPoint(random, 10));
    out.weights.push_back(random.uniform(-1, 1));
  }
  for (std::size_t i = 0; i < targets; ++i)
    out.targets.push_back(i % 5 == 0 ? out.sources[i % sources] : randomPoint(random, 10));
  return out;
}

Vec3 plainDirection(const Pairs& p, const Vec3& target) {
  Vec3 sum;
  for (std::size_t j = 0; j < p.sources.size(); ++j) {
    const Vec3 d = target - p.sources[j];
    if (norm(d) > 0) sum += d * (p.weights[j] / norm(d));
  }
  return sum;
}

double plainDistance(const Pairs& p, const Vec3& target) {
  long double sum = 0;
  for (std::size_t j = 0; j < p.sources.size(); ++j)
    sum += static_cast<long double>(p.weights[j]) * norm(target - p.sources[j]);
  return static_cast<double>(sum);
}

TEST(SimdSums, AreThePlainSumsForEveryNumberOfLanesLeftOver) {
  for (const std::size_t targets : {1UL, 7UL, 16UL, 33UL, 100UL}) {
    for (const std::size_t sources : {1UL, 8UL, 9UL, 200UL}) {
      const Pairs p = pairs(targets, sources, targets * 1000 + sources);
      const Coordinates t(p.targets), s(p.sources);
      std::vector<double> estimated(targets, 1.0), exact(targets, 1.0), x(targets, 0.0), y = x, z = x;
      addDistances(t.part(0, targets), s.part(0, sources), p.weights.data(), estimated.data());
      addExactDistances(t.part(0, targets), s.part(0, sources), p.weights.data(), exact.data());
      addDirections(t.part(0, targets), s.part(0, sources), p.weights.data(), x.data(), y.data(), z.data());
      // Terms up to 35: the root's stated error and one rounding a term.
      const double n = static_cast<double>(sources), tolerance = n * 35 * (3e-14 + 2.3e-16);
      for (std::size_t i = 0; i < targets; ++i) {
        EXPECT_NEAR(estimated[i] - 1, plainDistance(p, p.targets[i]), tolerance);
        EXPECT_NEAR(exact[i] - 1, plainDistance(p, p.targets[i]), n * 35 * 4.6e-16);
        EXPECT_LT(norm(Vec3{x[i], y[i], z[i]} - plainDirection(p, p.targets[i])), n * 1e-13);
      }
    }
  }
}

TEST(SimdSums, InSinglePrecisionRoundAsStated) {
  const Pairs p = pairs(64, 1000, 5);
  std::vector<float> t[3], s[3], w;
  for (const Vec3& v : p.targets)
    t[0].push_back(static_cast<float>(v.x)), t[1].push_back(static_cast<float>(v.y)),
        t[2].push_back(static_cast<float>(v.z));
  for (const Vec3& v : p.sources)
    s[0].push_back(static_cast<float>(v.x)), s[1].push_back(static_cast<float>(v.y)),
        s[2].push_back(static_cast<float>(v.z));
  double weigh = 0;
  for (const double x : p.weights) w.push_back(static_cast<float>(x)), weigh += std::abs(x) * 35;
  std::vector<double> out(64, 0.0);
  addDistances(PointArrays<float>{t[0].data(), t[1].data(), t[2].data(), 64},
               PointArrays<float>{s[0].data(), s[1].data(), s[2].data(), 1000}, w.data(), out.data());
  for (std::size_t i = 0; i < out.size(); ++i) EXPECT_NEAR(out[i], plainDistance(p, p.targets[i]), 4 * 6e-8 * weigh);
}

TEST(SimdSums, BothWaysAtOnceAreTheTwoSumsOneByOne) {
  for (const std::size_t a : {1UL, 17UL, 300UL}) {
    for (const std::size_t b : {1UL, 255UL, 257UL, 600UL}) {
      const Pairs p = pairs(a, b, a * 1000 + b);
      std::vector<double> wa(a), out_a(a, 0.0), out_b(b, 0.0), one_a(a, 0.0), one_b(b, 0.0);
      for (std::size_t i = 0; i < a; ++i) wa[i] = 0.1 * static_cast<double>(i % 7) - 0.3;
      const Coordinates ca(p.targets), cb(p.sources);
      addDistancesBothWays(ca.part(0, a), wa.data(), out_a.data(), cb.part(0, b), p.weights.data(), out_b.data());
      addDistances(ca.part(0, a), cb.part(0, b), p.weights.data(), one_a.data());
      addDistances(cb.part(0, b), ca.part(0, a), wa.data(), one_b.data());
      for (std::size_t i = 0; i < a; ++i) EXPECT_NEAR(out_a[i], one_a[i], 1e-12 * static_cast<double>(b) * 35);
      for (std::size_t j = 0; j < b; ++j) EXPECT_NEAR(out_b[j], one_b[j], 1e-12 * static_cast<double>(a) * 35);
    }
  }
}

TEST(DirectSum, OverAllPairsHasTheSameBitsFromAnyNumberOfThreads) {
  const Pairs p = pairs(1, 3000, 6);
  const Coordinates c(p.sources);
  const std::vector<double> one = distancesAmong(c, p.weights, 1), three = distancesAmong(c, p.weights, 3);
  EXPECT_EQ(one, three);
  for (std::size_t i = 0; i < 3000; i += 101) EXPECT_NEAR(one[i], plainDistance(p, p.sources[i]), 3000 * 35 * 4e-14);
}

TEST(DirectSum, FromOtherSourcesIsThePlainSumForEveryNumberOfLanesAndThreads) {
  // About the lanes of any vector, and about the rows that a thread takes.
  for (const std::size_t targets : {1UL, 3UL, 4UL, 5UL, 15UL, 16UL, 17UL, 63UL, 64UL, 65UL, 129UL}) {
    for (const std::size_t sources : {1UL, 2UL, 7UL, 8UL, 9UL, 31UL, 32UL, 33UL, 257UL}) {
      const std::uint64_t seed = 50'000 + targets * 1000 + sources;
      const Pairs p = pairs(targets, sources, seed);
      ASSERT_EQ(p.targets[0], p.sources[0]) << "one distance has to be 0";
      const Vec3 origin{1, -2, 3};
      const Coordinates t(p.targets, origin), s(p.sources, origin);
      const std::vector<double> out = distancesFrom(t, s, p.weights, 1);
      ASSERT_EQ(out.size(), targets);
      EXPECT_EQ(out, distancesFrom(t, s, p.weights, 3)) << "seed " << seed;
      // Terms up to 35, each with the root's stated error and two roundings; the origin costs one of 13 an axis.
      const double tolerance = static_cast<double>(sources) * (35 * (3e-14 + 4.6e-16) + 4 * 1.8e-15);
      for (std::size_t i = 0; i < targets; ++i)
        ASSERT_NEAR(out[i], plainDistance(p, p.targets[i]), tolerance) << "seed " << seed << ", point " << i;
    }
  }
}

template <class T>
void expectFactors(std::size_t n, double tolerance) {
  Random random(n);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < n; ++i) points.push_back(randomPoint(random, 0.5));
  Eigen::MatrixXd a(n, n);
  TiledCholesky<T> tiled(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      const double value = 2 - norm(points[i] - points[j]);
      a(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          a(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(i)) = value;
      tiled.at(i, j) = static_cast<T>(value);
    }
  }
  ASSERT_TRUE(tiled.factor(2));
  Eigen::VectorXd right(n);
  std::vector<T> x(tiled.paddedSize(), T{0});
  for (std::size_t i = 0; i < n; ++i)
    right(static_cast<Eigen::Index>(i)) = static_cast<double>(x[i] = static_cast<T>(random.uniform(-1, 1)));
  tiled.solveLower(x.data());
  tiled.solveUpper(x.data());
  Eigen::VectorXd ours(n);
  for (std::size_t i = 0; i < n; ++i) ours(static_cast<Eigen::Index>(i)) = static_cast<double>(x[i]);
  EXPECT_LT((a * ours - right).cwiseAbs().maxCoeff(), tolerance) << n;
}

TEST(TiledCholesky, SolvesWhatItFactoredForSizesAroundItsTiles) {
  for (const std::size_t n : {1UL, 2UL, 47UL, 48UL, 49UL, 200UL, 1000UL}) {
    // Backward error of a Cholesky solve: about 3 n eps |A||x| with entries up to 2 and solutions up to some hundred.
    expectFactors<double>(n, 3.0 * static_cast<double>(n) * 2.3e-16 * 2 * 1e3 * static_cast<double>(n));
    if (n <= 200) expectFactors<float>(n, 3.0 * static_cast<double>(n) * 6e-8 * 2 * 1e2);
  }
}

template <class T>
void expectFilled(std::size_t n, double rounding) {
  Random random(n + 7);
  std::vector<Vec3> points;
  TiledCholesky<T> tiled(n);
  std::vector<T> x(tiled.paddedSize(), T{0}), y = x, z = x;
  for (std::size_t i = 0; i < n; ++i) {
    points.push_back(randomPoint(random, 0.5));
    x[i] = static_cast<T>(points[i].x), y[i] = static_cast<T>(points[i].y), z[i] = static_cast<T>(points[i].z);
  }
  tiled.fill({x.data(), y.data(), z.data(), n}, T{3});
  for (std::size_t i = 0; i < tiled.paddedSize(); ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      const double own = i < n ? 3 : 1, other = i < n ? 2 - norm(points[i] - points[j]) : 0;
      EXPECT_NEAR(static_cast<double>(tiled.at(i, j)), i == j ? own : other, rounding) << i << " " << j;
    }
}

TEST(TiledCholesky, IsFilledWithTheKernelAndAUnitMatrixBeyondIt) {
  for (const std::size_t n : {1UL, 48UL, 100UL}) {
    // Of coordinates, their distance and two less that: four roundings of numbers below two.
    expectFilled<double>(n, 4 * 2.3e-16);
    expectFilled<float>(n, 4 * 1.2e-7);
  }
}

TEST(TiledCholesky, RefusesAMatrixThatIsNotPositiveDefinite) {
  TiledCholesky<double> two(2);
  two.at(0, 0) = two.at(1, 1) = 1, two.at(1, 0) = 1;
  EXPECT_FALSE(two.factor());
  TiledCholesky<double> negative(60);
  for (std::size_t i = 0; i < 60; ++i) negative.at(i, i) = i == 50 ? -1 : 1;
  EXPECT_FALSE(negative.factor());
}

template <class T>
void expectPlainProduct(double rounding) {
  Random random(3);
  for (const std::size_t columns : {1UL, 3UL, 8UL, 21UL}) {
    const std::size_t rows = 80, inner = 27;
    std::vector<T> a(rows * inner), x(inner * columns), y(rows * columns);
    std::vector<std::uint32_t> lengths(rows);
    for (std::size_t r = 0; r < rows; ++r) {
      lengths[r] = static_cast<std::uint32_t>(inner - r / 3);
      for (std::size_t k = 0; k < lengths[r]; ++k) a[k * rows + r] = static_cast<T>(random.uniform(-1, 1));
    }
    for (T& v : x) v = static_cast<T>(random.uniform(-1, 1));
    multiply({a.data(), rows, lengths.data()}, x.data(), inner, columns, y.data(), rows);
    for (std::size_t c = 0; c < columns; ++c)
      for (std::size_t r = 0; r < rows; ++r) {
        double sum = 0;
        for (std::size_t k = 0; k < inner; ++k) sum += static_cast<double>(a[k * rows + r]) * x[c * inner + k];
        EXPECT_NEAR(y[c * rows + r], sum, 27 * 27 * rounding);
      }
  }
}

TEST(Multiply, IsThePlainProduct) {
  // 27 terms of at most 1, and as many roundings of at most 27 halves of epsilon.
  expectPlainProduct<double>(1.2e-16);
  expectPlainProduct<float>(6e-8);
}

/// The slow twin: the whole saddle-point system at once, by LU with full pivoting.
TEST(DenseSystem, GivesTheSolutionOfTheWholeSystem) {
  Random random(15);
  const double ridge = 0.3;
  std::vector<Vec3> points;
  std::vector<double> values, weights(60);
  for (int i = 0; i < 60; ++i) points.push_back(randomPoint(random, 10)), values.push_back(random.uniform(-1, 1));
  const auto system = DenseSystem<double>::make(points, ridge, 1);
  ASSERT_TRUE(system);
  const Polynomial p = system->solve(values, weights);

  Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(64, 64);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(64);
  for (int i = 0; i < 60; ++i) {
    const Vec3& at = points[static_cast<std::size_t>(i)];
    for (int j = 0; j < 60; ++j) whole(i, j) = -norm(at - points[static_cast<std::size_t>(j)]);
    whole(i, i) = ridge;
    whole.block<1, 4>(i, 60) << 1, at.x, at.y, at.z;
    whole.block<4, 1>(60, i) << 1, at.x, at.y, at.z;
    right(i) = values[static_cast<std::size_t>(i)];
  }
  const Eigen::VectorXd x = whole.fullPivLu().solve(right);
  for (int i = 0; i < 60; ++i) EXPECT_NEAR(weights[static_cast<std::size_t>(i)], x(i), 1e-10) << "seed 15";
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(p[static_cast<std::size_t>(k)], x(60 + k), 1e-9);
}

TEST(Chebyshev, IsExactForPolynomialsOfItsDegreeThroughParentsAndChildren) {
  const Chebyshev parent(6), child(5);
  const Transfer transfer = Transfer::toOctants(parent, child);
  Random random(4);
  const double middle[3] = {1, -2, 3}, half = 2;
  std::vector<double> at_parent(parent.stored(), 0.0), at_child(child.stored(), 0.0);
  const auto function = [](double x, double y, double z) {
    return 1 + x * y * z + x * x * x - 2 * y * y * z * z + z * z * z * z;
  };
  std::size_t n = 0;
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < 6; ++b)
      for (int c = 0; c < 6; ++c) at_parent[n++] = function(parent.root(a), parent.root(b), parent.root(c));
  transfer.toFine(5, at_parent.data(), at_child.data());  // upper x, lower y, upper z
  const double child_middle[3] = {2, -3, 4};
  for (int i = 0; i < 50; ++i) {
    const Vec3 p{random.uniform(1, 3), random.uniform(-4, -2), random.uniform(3, 5)};
    double from_parent = 0, from_child = 0, gx = 0, gy = 0, gz = 0;
    const PointArrays<double> point{&p.x, &p.y, &p.z, 1};
    parent.spread(at_parent.data(), middle, half, point, &from_parent);
    child.spread(at_child.data(), child_middle, half / 2, point, &from_child);
    parent.spreadGradient(at_parent.data(), middle, half, point, &gx, &gy, &gz);
    const double x = (p.x - 1) / 2, y = (p.y + 2) / 2, z = (p.z - 3) / 2;
    EXPECT_NEAR(from_parent, function(x, y, z), 1e-13);
    EXPECT_NEAR(from_child, function(x, y, z), 1e-13);
    EXPECT_NEAR(gx, (y * z + 3 * x * x) / 2, 1e-12);
    EXPECT_NEAR(gz, (x * y - 4 * y * y * z + 4 * z * z * z) / 2, 1e-12);
  }
}

TEST(Chebyshev, GatheredWeightsHaveThePointsMomentsInTheChildAndItsParent) {
  const Chebyshev parent(4), child(4);
  const Transfer transfer = Transfer::toOctants(parent, child);
  Random random(5);
  std::vector<double> x, y, z, w;
  for (int i = 0; i < 30; ++i)
    x.push_back(random.uniform(0, 1)), y.push_back(random.uniform(-1, 0)), z.push_back(random.uniform(0, 1)),
        w.push_back(random.uniform(-1, 1));
  const double middle[3] = {0.5, -0.5, 0.5};
  std::vector<double> at_child(child.stored(), 0.0), at_parent(parent.stored(), 0.0);
  child.gather({x.data(), y.data(), z.data(), 30}, w.data(), middle, 0.5, at_child.data());
  transfer.toCoarse(5, at_child.data(), at_parent.data());
  double wanted = 0, found = 0;
  for (int i = 0; i < 30; ++i)
    wanted += w[static_cast<std::size_t>(i)] * x[static_cast<std::size_t>(i)] * x[static_cast<std::size_t>(i)] *
              y[static_cast<std::size_t>(i)] * z[static_cast<std::size_t>(i)];
  std::size_t n = 0;
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b < 4; ++b)
      for (int c = 0; c < 4; ++c)
        found += at_parent[n++] * parent.root(a) * parent.root(a) * parent.root(b) * parent.root(c);
  EXPECT_NEAR(found, wanted, 1e-13);
}

}  // namespace
}  // namespace spinaltap::rbf
