#include "core/mesh/polygonise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/base/dmath.h"
#include "core/base/parallel.h"
#include "core/base/random.h"
#include "core/mesh/lattice.h"
#include "core/mesh/parts.h"
#include "core/phantom/phantom.h"
#include "tests/core/mesh/fields.h"

namespace spinaltap::mesh {
namespace {

TEST(Polygonise, ASphereIsClosedRoundAndTurnedOutward) {
  const Vec3 middle{0.123, -0.456, 0.789};
  const double cell = 0.7;
  const auto mesh = polygonise(fieldOf([&](const Vec3& p) { return norm(p - middle) - 10; }),
                               std::vector<Vec3>{{10.2, 0, 0}}, boxOf(12, cell));
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  const MeshCheck c = expectSound(*mesh);
  EXPECT_EQ(c.euler, 2);
  EXPECT_EQ(c.parts, 1U);
  for (std::size_t v = 0; v < mesh->vertices.size(); ++v) {
    // The last secant moved by less than 1e-3 of an edge of at most 1.26 cells.
    EXPECT_NEAR(norm(mesh->vertices[v] - middle), 10, 1.26e-3 * cell);
    EXPECT_GT(dot(mesh->normals[v], normalized(mesh->vertices[v] - middle)), 0.99999);
  }
  // A chord polyhedron loses at most the sagitta of its longest edge e, e^2 / 8r, over its area. An edge of a triangle
  // lies in a tetrahedron whose nodes are 1.26 cells apart and may have moved by a third of that at either end.
  const double full = 4.0 / 3 * kPi * 1000, sagitta = std::pow(1.26 * cell * 5 / 3, 2) / 80;
  EXPECT_LT(c.volume_mm3, full);
  EXPECT_GT(c.volume_mm3, full - 4 * kPi * 100 * sagitta);
}

TEST(Polygonise, TheFacetsComeCloserWithTheSquareOfTheCell) {
  double last = 0;
  for (const double cell : {2.0, 1.0, 0.5}) {
    const auto mesh = polygonise(fieldOf([](const Vec3& p) { return norm(p) - 10; }), std::vector<Vec3>{{0, 0, 10}},
                                 boxOf(14.1, cell));
    ASSERT_TRUE(mesh.has_value());
    double worst = 0;
    for (const auto& t : mesh->triangles) {
      const Vec3 middle = (mesh->vertices[t[0]] + mesh->vertices[t[1]] + mesh->vertices[t[2]]) / 3;
      worst = std::max(worst, 10 - norm(middle));
    }
    EXPECT_LT(worst, std::pow(1.26 * cell * 5 / 3, 2) / 80) << cell;
    if (last > 0) {
      EXPECT_LT(worst, last / 2.5);
    }
    last = worst;
  }
}

TEST(Polygonise, ATorusHasOneHoleAndItsVerticesLieOnIt) {
  const auto mesh = polygonise(fieldOf(torus), std::vector<Vec3>{{13, 0, 0}}, boxOf(14, 0.61));
  ASSERT_TRUE(mesh.has_value());
  const MeshCheck c = expectSound(*mesh);
  EXPECT_EQ(c.euler, 0);
  EXPECT_EQ(c.parts, 1U);
  for (const Vec3& v : mesh->vertices) EXPECT_NEAR(torus(v), 0, 1.26e-3 * 0.61);
}

/// The seeds of a reconstruction: points about a millimetre apart, not quite on the surface.
std::vector<Vec3> seedsOn(const TriangleMesh& mesh, double noise, Random& random) {
  std::vector<Vec3> seeds;
  for (std::size_t v = 0; v < mesh.vertices.size(); v += 2) {
    seeds.push_back(mesh.vertices[v] + mesh.normals[v] * random.uniform(-noise, noise));
  }
  return seeds;
}

TEST(Polygonise, MeetsThePhantomsExactSurfaceInAFewLargeBatches) {
  const auto phantom = phantom::Phantom::make({.seed = 3});
  const Vec3 margin{2, 2, 2};
  const Vec3 low = phantom.bounds().low_patient - margin, high = phantom.bounds().high_patient + margin;
  const auto coarse = polygonise(phantom.field(), std::vector<Vec3>{phantom.pedicle(phantom::Side::Left).entry_patient},
                                 {1.5, low, high});
  ASSERT_TRUE(coarse.has_value()) << coarse.error().message;
  Random random(11);
  const auto seeds = seedsOn(*coarse, 0.2, random);

  std::size_t values = 0, gradients = 0, calls = 0;
  Field field = phantom.field();
  field.values = [&, inner = field.values](std::span<const Vec3> p, std::span<double> out) {
    values += p.size(), ++calls, inner(p, out);
  };
  field.gradients = [&, inner = field.gradients](std::span<const Vec3> p, std::span<Vec3> out) {
    gradients += p.size(), ++calls, inner(p, out);
  };
  const double cell = 1;
  const auto mesh = polygonise(field, seeds, {cell, low, high});
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  const MeshCheck c = expectSound(*mesh);
  EXPECT_EQ(c.parts, 1U);
  EXPECT_EQ(c.euler, 0) << "one tunnel, the canal";
  double worst = 0;
  for (std::size_t v = 0; v < mesh->vertices.size(); v += 7) {
    worst = std::max(worst, std::abs(phantom.distanceToSurface(mesh->vertices[v])));
  }
  EXPECT_LT(worst, 1.26e-3 * cell);
  EXPECT_EQ(gradients, mesh->vertices.size());
  EXPECT_LT(values, 4 * mesh->vertices.size());
  EXPECT_LE(calls, 20U);
  std::printf("  %zu vertices, %zu triangles on %.0f mm2, %zu values, %zu calls, least angle %.1f, worst %.1e mm\n",
              mesh->vertices.size(), mesh->triangles.size(), c.area_mm2, values, calls, c.least_angle_deg, worst);
}

/// Values at the nodes of a grid of cubes are drawn at random, and blended linearly between them: sheets, tunnels and
/// specks of every shape side by side. Negative values are scaled by `lopsided`, so that crossings crowd to one end.
double noise(std::uint64_t seed, int n, double lopsided, const Vec3& p) {
  const auto node = [seed, n](int i, int j, int k) {
    if (i < 2 || j < 2 || k < 2 || i > n - 2 || j > n - 2 || k > n - 2) return 1.0;
    return Random(combine(seed, static_cast<std::uint64_t>((i * 64 + j) * 64 + k))).uniform(-1, 1);
  };
  const int i = static_cast<int>(std::floor(p.x)), j = static_cast<int>(std::floor(p.y)),
            k = static_cast<int>(std::floor(p.z));
  double sum = 0;
  for (int c = 0; c < 8; ++c) {
    const double fx = p.x - i, fy = p.y - j, fz = p.z - k;
    const double share = ((c & 1) != 0 ? fx : 1 - fx) * ((c & 2) != 0 ? fy : 1 - fy) * ((c & 4) != 0 ? fz : 1 - fz);
    if (share != 0) sum += share * node(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
  }
  return sum < 0 ? sum * lopsided : sum;
}

/// By asking the field at every node: nodes less edges plus faces less tetrahedra that are wholly inside. The surface
/// of such a body has twice its Euler number.
template <class F>
long long eulerOfSigns(const F& value, const PolygoniseOptions& options) {
  const double half = options.cell_mm * 1.2599210498948732 / 2;
  const int n = 2 * static_cast<int>(std::ceil((options.high_patient.x - options.low_patient.x) / (2 * half)));
  const Lattice lattice{options.low_patient, half, {n, n, n}};
  std::set<Key> inside;
  for (int z = 0; z <= n; ++z)
    for (int y = z % 2; y <= n; y += 2)
      for (int x = z % 2; x <= n; x += 2) {
        if (value(lattice.place({x, y, z})) < 0) inside.insert(keyOf({x, y, z}));
      }
  std::set<std::array<Key, 2>> edges;
  std::set<std::array<Key, 3>> faces;
  long long tetrahedra = 0;
  const auto holds = [&](Key key) { return inside.count(key) != 0; };
  for (int z = 0; z <= n; ++z)
    for (int y = z % 2; y <= n; y += 2)
      for (int x = z % 2; x <= n; x += 2) {
        for (const Tet& tet : kTets) {
          std::vector<Key> in;
          for (const Node& c : tet.corner) {
            const Node at = Node{x, y, z} + c;
            if (lattice.holds(at) && holds(keyOf(at))) in.push_back(keyOf(at));
          }
          std::sort(in.begin(), in.end());
          for (std::size_t a = 0; a < in.size(); ++a)
            for (std::size_t b = a + 1; b < in.size(); ++b) {
              edges.insert({in[a], in[b]});
              for (std::size_t c = b + 1; c < in.size(); ++c) faces.insert({in[a], in[b], in[c]});
            }
          tetrahedra += in.size() == 4 ? 1 : 0;
        }
      }
  const auto count = [](const auto& set) { return static_cast<long long>(set.size()); };
  return 2 * (count(inside) - count(edges) + count(faces) - tetrahedra);
}

TEST(Polygonise, KeepsItsPromisesOnNoiseOfTheSizeOfACell) {
  const int n = 12;
  for (const double cell : {0.8, 0.45}) {
    std::vector<Vec3> seeds;  // in every cube of the lattice
    const int side = static_cast<int>(n / cell);
    for (int at = 0; at < side * side * side; ++at) {
      seeds.push_back(Vec3{at % side + 0.5, at / side % side + 0.5, at / side / side + 0.5} * cell);
    }
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
      for (const double lopsided : {1.0, 0.03, 1e-9}) {
        SCOPED_TRACE(testing::Message() << "seed " << seed << " lopsided " << lopsided << " cell " << cell);
        const auto value = [&](const Vec3& p) { return noise(seed, n, lopsided, p); };
        const PolygoniseOptions options{cell, {0, 0, 0}, {1.0 * n, 1.0 * n, 1.0 * n}};
        const auto mesh = polygonise(fieldOf(value), seeds, options);
        ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
        EXPECT_GT(mesh->triangles.size(), 1000U);
        EXPECT_EQ(expectSound(*mesh).euler, eulerOfSigns(value, options));
      }
    }
  }
}

TEST(Polygonise, FindsOnlyTheSurfacesThatHaveASeed) {
  const auto three = [](const Vec3& p) {
    return std::min({norm(p), norm(p - Vec3{9, 0, 0}), norm(p - Vec3{0, 9, 0})}) - 3;
  };
  const std::vector<Vec3> seeds{{3, 0, 0}, {12, 0, 0}};
  const auto two = polygonise(fieldOf(three), seeds, boxOf(13, 0.5));
  ASSERT_TRUE(two.has_value());
  const MeshCheck c = expectSound(*two);
  EXPECT_EQ(c.parts, 2U);
  EXPECT_EQ(c.euler, 4);
}

TEST(Polygonise, FindsTheSurfaceFromSeedsUpToACellAwayFromIt) {
  const auto field = fieldOf([](const Vec3& p) { return norm(p) - 5; });
  Random random(5);
  for (int n = 0; n < 60; ++n) {
    const Vec3 way = normalized(Vec3{random.gaussian(), random.gaussian(), random.gaussian()});
    const auto mesh = polygonise(field, std::vector<Vec3>{way * (5 + random.uniform(-0.8, 0.8))}, boxOf(8, 0.8));
    ASSERT_TRUE(mesh.has_value()) << n;
    EXPECT_EQ(check(*mesh).parts, 1U);
  }
}

TEST(Polygonise, DoesNotDependOnTheOrderOrNumberOfSeeds) {
  const auto field = fieldOf([](const Vec3& p) { return norm(p) - 5; });
  std::vector<Vec3> seeds{{5, 0, 0}, {0, 5, 0}, {0, 0, -5}, {3, 4, 0}};
  const auto a = polygonise(field, seeds, boxOf(7, 0.5));
  std::reverse(seeds.begin(), seeds.end());
  seeds.push_back({0, -5.2, 0});
  const auto b = polygonise(field, seeds, boxOf(7, 0.5));
  ASSERT_TRUE(a.has_value() && b.has_value());
  EXPECT_EQ(a->vertices, b->vertices);
  EXPECT_EQ(a->normals, b->normals);
  EXPECT_EQ(a->triangles, b->triangles);
}

TEST(Polygonise, GivesTheSameBitsFromAnyNumberOfThreads) {
  const auto meshFrom = [](unsigned threads) {
    Field field;
    field.values = [threads](std::span<const Vec3> p, std::span<double> out) {
      parallelBlocks(p.size(), 100, threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) out[i] = torus(p[i]);
      });
    };
    field.gradients = [threads](std::span<const Vec3> p, std::span<Vec3> out) {
      parallelBlocks(p.size(), 100, threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          const double around = std::sqrt(p[i].x * p[i].x + p[i].y * p[i].y), ring = around - 10;
          out[i] = {p[i].x / around * ring, p[i].y / around * ring, p[i].z};
        }
      });
    };
    return polygonise(field, std::vector<Vec3>{{13, 0, 0}}, boxOf(14, 0.9));
  };
  const auto one = meshFrom(1);
  ASSERT_TRUE(one.has_value());
  for (const unsigned threads : {2U, 5U}) {
    const auto more = meshFrom(threads);
    ASSERT_TRUE(more.has_value());
    EXPECT_EQ(one->vertices, more->vertices);
    EXPECT_EQ(one->normals, more->normals);
    EXPECT_EQ(one->triangles, more->triangles);
  }
}

TEST(Polygonise, AsksOnlyNearTheSurface) {
  std::size_t asked = 0;
  Field field = fieldOf([](const Vec3& p) { return norm(p) - 20; });
  field.values = [&, inner = field.values](std::span<const Vec3> p, std::span<double> out) {
    asked += p.size(), inner(p, out);
  };
  const auto mesh = polygonise(field, std::vector<Vec3>{{20, 0, 0}}, boxOf(25, 0.5));
  ASSERT_TRUE(mesh.has_value());
  EXPECT_LT(asked, 4 * mesh->vertices.size());  // the box has a million nodes
}

TEST(LargestPart, KeepsTheLargerOfTwoBallsWhole) {
  const auto two = [](const Vec3& p) { return std::min(norm(p - Vec3{6, 0, 0}) - 2, norm(p + Vec3{4, 0, 0}) - 4); };
  const auto both = polygonise(fieldOf(two), std::vector<Vec3>{{8, 0, 0}, {-8, 0, 0}}, boxOf(10, 0.5));
  ASSERT_TRUE(both.has_value());
  ASSERT_EQ(check(*both).parts, 2U);
  const TriangleMesh one = largestPart(*both);
  const MeshCheck c = expectSound(one);
  EXPECT_EQ(c.parts, 1U);
  EXPECT_NEAR(c.volume_mm3, 4.0 / 3 * kPi * 64, 8);  // the sagittas of 0.5 mm cells: some 3 %
  for (const Vec3& v : one.vertices) EXPECT_NEAR(norm(v + Vec3{4, 0, 0}), 4, 1e-3);
  EXPECT_TRUE(largestPart({}).vertices.empty());
}

}  // namespace
}  // namespace spinaltap::mesh
