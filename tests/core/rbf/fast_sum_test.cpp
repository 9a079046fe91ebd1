#include "core/rbf/fast_sum.h"

#include <gtest/gtest.h>

#include "core/rbf/direct_sum.h"
#include "tests/core/rbf/sets.h"

namespace spinaltap::rbf {
namespace {

enum class Shape { Surface, Ball, Line, Clusters, OnePlace };

std::vector<Vec3> setOf(Shape shape, std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<Vec3> out;
  for (std::size_t i = 0; i < count; ++i) {
    const double t = random.uniform(-1, 1);
    switch (shape) {
      case Shape::Surface:
        out.push_back(randomDirection(random) * (20 + 3 * t * t));
        break;
      case Shape::Ball:
        out.push_back(randomDirection(random) * (20 * std::cbrt(std::abs(t))));
        break;
      case Shape::Line:
        out.push_back(Vec3{1, 2, 3} * (10 * t));
        break;
      // Two crowds a millionth as wide as they are apart, and a few points between.
      case Shape::Clusters:
        out.push_back(i % 50 == 0 ? Vec3{20 * t, 0, 0}
                                  : Vec3{i % 2 == 0 ? 20.0 : -20.0, 0, 0} + randomPoint(random, 2e-5));
        break;
      case Shape::OnePlace:
        out.push_back({3, 4, 5});
        break;
    }
  }
  return out;
}

struct Sums {
  std::vector<double> direct, fast;
  std::vector<Vec3> direct_slope, fast_slope;
  double weight = 0;  ///< sum |w|

  [[nodiscard]] double error() const {
    double most = 0;
    for (std::size_t i = 0; i < direct.size(); ++i) most = std::max(most, std::abs(direct[i] - fast[i]));
    return most;
  }
  [[nodiscard]] double rmsError() const {
    double squares = 0;
    for (std::size_t i = 0; i < direct.size(); ++i) squares += (direct[i] - fast[i]) * (direct[i] - fast[i]);
    return std::sqrt(squares / static_cast<double>(direct.size()));
  }
  [[nodiscard]] double slopeError() const {
    double most = 0;
    for (std::size_t i = 0; i < direct.size(); ++i) most = std::max(most, norm(direct_slope[i] - fast_slope[i]));
    return most;
  }
};

std::vector<double> weightsOf(std::size_t count) {
  Random random(count);
  std::vector<double> out;
  for (std::size_t j = 0; j < count; ++j) out.push_back(random.uniform(-1, 1));
  return out;
}

Sums sums(const std::vector<Vec3>& sources, const std::vector<Vec3>& targets, const FastSumOptions& options) {
  const std::vector<double> w = weightsOf(sources.size());
  Sums out;
  for (const double x : w) out.weight += std::abs(x);
  const std::size_t n = targets.size();
  const Coordinates s(sources), t(targets);
  std::vector<double> x(n, 0.0), y = x, z = x;
  out.direct.assign(n, 0.0), out.fast.resize(n), out.fast_slope.resize(n);
  addExactDistances(t.part(0, n), s.part(0, sources.size()), w.data(), out.direct.data());
  addExactDirections(t.part(0, n), s.part(0, sources.size()), w.data(), x.data(), y.data(), z.data());
  for (std::size_t i = 0; i < n; ++i) out.direct_slope.push_back({x[i], y[i], z[i]});
  const FastSum fast(sources, targets, options);
  fast.values(w, out.fast);
  fast.gradients(w, out.fast_slope);
  return out;
}

FastSumOptions small(int nodes) {
  FastSumOptions o;
  o.nodes = nodes, o.leaf_size = 30, o.target_leaf_size = 20;
  return o;
}

TEST(FastSum, IsTheDirectSumForSurfacesBallsLinesCrowdsAndHeaps) {
  for (const Shape shape : {Shape::Surface, Shape::Ball, Shape::Line, Shape::Clusters, Shape::OnePlace}) {
    const std::vector<Vec3> sources = setOf(shape, 1000, 1), targets = setOf(shape, 700, 2);
    for (const bool same : {true, false}) {
      const Sums s = sums(sources, same ? sources : targets, small(8));
      // Far sources: 8 nodes an axis, cubes at least their own width apart: 5.83^-8 = 7e-7 of sum |w| times the set's
      // width (40), for the largest cubes; and as much again for all the smaller ones.
      EXPECT_LT(s.error(), 2 * 7e-7 * s.weight * 40) << "shape " << static_cast<int>(shape) << (same ? " same" : "");
      // A derivative of the interpolant costs at most a factor of degree squared over half a cube: 49 / 2.5.
      EXPECT_LT(s.slopeError(), 20 * 2 * 7e-7 * s.weight * 40) << "shape " << static_cast<int>(shape);
    }
  }
}

TEST(FastSum, GainsWithEveryNode) {
  const std::vector<Vec3> set = setOf(Shape::Surface, 1200, 3);
  double before = 1e9;
  for (int nodes = 4; nodes <= 9; ++nodes) {
    const double error = sums(set, set, small(nodes)).error();
    EXPECT_LT(error, 0.7 * before) << nodes;
    before = error;
  }
}

TEST(FastSum, WithTargetsFarFromAllSourcesAndSourcesFarFromAllTargets) {
  std::vector<Vec3> sources = setOf(Shape::Surface, 1000, 4), targets = setOf(Shape::Ball, 1000, 5);
  for (Vec3& t : targets) t += Vec3{500, 0, 0};
  const Sums s = sums(sources, targets, small(8));
  EXPECT_LT(s.error(), 2 * 7e-7 * s.weight * 540);
}

TEST(FastSum, HasTheSameBitsFromAnyNumberOfThreadsAndNearTheDirectSumInSinglePrecision) {
  const std::vector<Vec3> set = setOf(Shape::Surface, 1200, 6);
  FastSumOptions one = small(7), three = one;
  one.threads = 1, three.threads = 3;
  EXPECT_EQ(sums(set, set, one).fast, sums(set, set, three).fast);
  one.single_error = std::numeric_limits<double>::infinity();
  const Sums s = sums(set, set, one);
  EXPECT_LT(s.error(), 2 * 5e-6 * s.weight * 40);
}

TEST(FastSum, StaysWithinTheErrorsItIsAskedForWithTheseWeights) {
  for (const Shape shape : {Shape::Surface, Shape::Ball, Shape::Clusters}) {
    const std::vector<Vec3> sources = setOf(shape, 3000, 8), targets = setOf(shape, 800, 9);
    const std::vector<double> weights = weightsOf(sources.size());
    for (const double error : {1e-2, 1e-4, 1e-6}) {
      for (const double single_error : {0.0, error}) {
        FastSumOptions options;
        options.weights = weights, options.error = error, options.single_error = single_error;
        const Sums s = sums(sources, targets, options);
        // Single precision may take its share twice, near and far; what is "about" the error comes to less than it.
        EXPECT_LT(s.rmsError(), error + std::sqrt(2) * single_error)
            << "shape " << static_cast<int>(shape) << ", error " << error << ", single " << single_error;
      }
    }
  }
}

TEST(Octree, HoldsEveryPointOnceInTheCubeItSays) {
  for (const Shape shape : {Shape::Surface, Shape::Clusters, Shape::OnePlace}) {
    const std::vector<Vec3> set = setOf(shape, 1000, 7);
    const Octree tree(set, RootCube::around(set), 25);
    std::vector<int> seen(set.size(), 0);
    for (const OctreeNode& node : tree.nodes()) {
      if (!node.leaf()) continue;
      EXPECT_TRUE(node.count <= 25 || node.level == Octree::kDeepest);
      const Vec3 middle = tree.root().middle + tree.middleOf(node);
      // A cube's side is found by halving: within the rounding of the coordinates.
      const double half = tree.halfOf(node.level) + 1e-12 * tree.root().half;
      for (std::uint32_t n = node.first; n < node.first + node.count; ++n) {
        const Vec3 d = set[tree.order()[n]] - middle;
        EXPECT_LE(std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)}), half);
        ++seen[tree.order()[n]];
      }
    }
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), 1000);
  }
}

}  // namespace
}  // namespace spinaltap::rbf
