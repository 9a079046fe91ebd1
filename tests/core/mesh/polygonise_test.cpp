#include "core/mesh/polygonise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/dmath.h"
#include "core/base/random.h"
#include "core/mesh/cube_table.h"
#include "core/mesh/parts.h"
#include "tests/core/mesh/mesh_check.h"

namespace spinaltap::mesh {
namespace {

template <class F>
Field fieldOf(F value) {
  Field field;
  field.values = [value](std::span<const Vec3> p, std::span<double> out) {
    for (std::size_t i = 0; i < p.size(); ++i) out[i] = value(p[i]);
  };
  field.gradients = [value](std::span<const Vec3> p, std::span<Vec3> out) {
    const double h = 1e-5;
    for (std::size_t i = 0; i < p.size(); ++i) {
      const auto slope = [&](const Vec3& d) { return (value(p[i] + d) - value(p[i] - d)) / (2 * h); };
      out[i] = {slope({h, 0, 0}), slope({0, h, 0}), slope({0, 0, h})};
    }
  };
  return field;
}

PolygoniseOptions boxOf(double half, double cell) { return {cell, {-half, -half, -half}, {half, half, half}}; }

void expectClosedManifold(const TriangleMesh& m) {
  const MeshCheck c = check(m);
  EXPECT_EQ(c.open_edges, 0U);
  EXPECT_EQ(c.repeated_edges, 0U);
  EXPECT_EQ(c.pinched_vertices, 0U);
  EXPECT_EQ(m.normals.size(), m.vertices.size());
}

TEST(CubeTable, UsesEveryCrossingAndNoOtherEdge) {
  for (int mask = 0; mask < 256; ++mask) {
    std::array<int, 12> used{};
    std::size_t corners_cut = 0;
    for (const auto& t : cubeTable().triangles[static_cast<std::size_t>(mask)])
      for (const int e : t) used[static_cast<std::size_t>(e)] = 1;
    for (int e = 0; e < 12; ++e) {
      const CubeEdge edge = cubeEdge(e);
      const bool crossed = ((mask >> edge.corner) & 1) != ((mask >> (edge.corner | 1 << edge.axis)) & 1);
      EXPECT_EQ(used[static_cast<std::size_t>(e)] == 1, crossed) << "mask " << mask << " edge " << e;
      corners_cut += crossed ? 1 : 0;
    }
    if (mask != 0 && mask != 255) {
      EXPECT_GE(corners_cut, 3U);
    }
  }
}

/// Random signs put every one of the 256 cases, and every pair of neighbours, side by side.
TEST(Polygonise, IsClosedAndManifoldOnRandomSigns) {
  const int n = 24;
  const double cell = 1;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    // The value at a node is random; outside the block all is outside. Evaluated at nodes it must be consistent, so it
    // is a hash of the rounded place; between nodes it is blended linearly along x, y and z.
    const auto node = [seed](int i, int j, int k) {
      if (i < 2 || j < 2 || k < 2 || i > n - 2 || j > n - 2 || k > n - 2) return 1.0;
      Random random(combine(seed, static_cast<std::uint64_t>((i * 64 + j) * 64 + k)));
      return random.uniform(-1, 1);
    };
    const auto value = [node](const Vec3& p) {
      const int i = static_cast<int>(std::floor(p.x)), j = static_cast<int>(std::floor(p.y)),
                k = static_cast<int>(std::floor(p.z));
      double sum = 0;
      for (int c = 0; c < 8; ++c) {
        const double fx = p.x - i, fy = p.y - j, fz = p.z - k;
        const double share = ((c & 1) != 0 ? fx : 1 - fx) * ((c & 2) != 0 ? fy : 1 - fy) * ((c & 4) != 0 ? fz : 1 - fz);
        if (share != 0) sum += share * node(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
      }
      return sum;
    };
    std::vector<Vec3> seeds;
    for (int at = 0; at < n * n * n; ++at) seeds.push_back({at % n + 0.5, at / n % n + 0.5, at / n / n + 0.5});
    const auto mesh = polygonise(fieldOf(value), seeds, {cell, {0, 0, 0}, {1.0 * n, 1.0 * n, 1.0 * n}});
    ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
    SCOPED_TRACE(seed);
    EXPECT_GT(mesh->triangles.size(), 10000U);
    expectClosedManifold(*mesh);
  }
}

TEST(Polygonise, ASphereIsClosedRoundAndTurnedOutward) {
  const Vec3 middle{0.123, -0.456, 0.789};
  const auto mesh = polygonise(fieldOf([&](const Vec3& p) { return norm(p - middle) - 10; }),
                               std::vector<Vec3>{{10.2, 0, 0}}, boxOf(12, 0.7));
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  expectClosedManifold(*mesh);
  const MeshCheck c = check(*mesh);
  EXPECT_EQ(c.euler, 2);
  EXPECT_EQ(c.parts, 1U);
  for (std::size_t v = 0; v < mesh->vertices.size(); ++v) {
    // The root is met to a thousandth of a cell, or moved by as much to keep off a node.
    EXPECT_NEAR(norm(mesh->vertices[v] - middle), 10, 2 * 0.7e-3);
    EXPECT_GT(dot(mesh->normals[v], normalized(mesh->vertices[v] - middle)), 0.99999);
  }
  // A chord polyhedron loses at most the sagitta of a cell's diagonal: (0.7 * 1.73)^2 / (8 * 10) of the radius 10.
  const double full = 4.0 / 3 * kPi * 1000;
  EXPECT_LT(c.volume_mm3, full);
  EXPECT_GT(c.volume_mm3, full * (1 - 3 * (0.7 * 0.7 * 3) / 80 / 10));
}

TEST(Polygonise, TheFacetsComeCloserWithTheSquareOfTheCell) {
  double last = 0;
  for (const double cell : {2.0, 1.0, 0.5}) {
    const auto mesh = polygonise(fieldOf([](const Vec3& p) { return norm(p) - 10; }), std::vector<Vec3>{{0, 0, 10}},
                                 boxOf(13.1, cell));
    ASSERT_TRUE(mesh.has_value());
    double worst = 0;
    for (const auto& t : mesh->triangles) {
      const Vec3 middle = (mesh->vertices[t[0]] + mesh->vertices[t[1]] + mesh->vertices[t[2]]) / 3;
      worst = std::max(worst, 10 - norm(middle));
    }
    EXPECT_LT(worst, 3 * cell * cell / (8 * 10)) << cell;
    if (last > 0) {
      EXPECT_LT(worst, last / 2.5);
    }
    last = worst;
  }
}

TEST(Polygonise, ATorusHasOneHole) {
  const auto torus = [](const Vec3& p) {
    const double ring = std::sqrt(p.x * p.x + p.y * p.y) - 10;
    return std::sqrt(ring * ring + p.z * p.z) - 3;
  };
  const auto mesh = polygonise(fieldOf(torus), std::vector<Vec3>{{13, 0, 0}}, boxOf(14, 0.61));
  ASSERT_TRUE(mesh.has_value());
  expectClosedManifold(*mesh);
  EXPECT_EQ(check(*mesh).euler, 0);
  EXPECT_EQ(check(*mesh).parts, 1U);
}

TEST(Polygonise, FindsOnlyTheSurfacesThatHaveASeed) {
  const auto three = [](const Vec3& p) {
    return std::min({norm(p), norm(p - Vec3{9, 0, 0}), norm(p - Vec3{0, 9, 0})}) - 3;
  };
  const std::vector<Vec3> seeds{{3, 0, 0}, {12, 0, 0}};
  const auto two = polygonise(fieldOf(three), seeds, boxOf(13, 0.5));
  ASSERT_TRUE(two.has_value());
  expectClosedManifold(*two);
  EXPECT_EQ(check(*two).parts, 2U);
  EXPECT_EQ(check(*two).euler, 4);
}

TEST(LargestPart, KeepsTheLargerOfTwoBallsWhole) {
  const auto two = [](const Vec3& p) { return std::min(norm(p - Vec3{6, 0, 0}) - 2, norm(p + Vec3{4, 0, 0}) - 4); };
  const auto both = polygonise(fieldOf(two), std::vector<Vec3>{{8, 0, 0}, {-8, 0, 0}}, boxOf(10, 0.5));
  ASSERT_TRUE(both.has_value());
  ASSERT_EQ(check(*both).parts, 2U);
  const TriangleMesh one = largestPart(*both);
  expectClosedManifold(one);
  EXPECT_EQ(check(one).parts, 1U);
  EXPECT_NEAR(check(one).volume_mm3, 4.0 / 3 * kPi * 64, 8);  // the sagittas of 0.5 mm cells: some 3 %
  for (const Vec3& v : one.vertices) EXPECT_NEAR(norm(v + Vec3{4, 0, 0}), 4, 1e-3);
  EXPECT_TRUE(largestPart({}).vertices.empty());
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
  EXPECT_EQ(a->triangles, b->triangles);
}

TEST(Polygonise, FieldsThatAreExactlyZeroAtNodesGiveNoCollapsedTriangles) {
  // A cube with faces on node planes: whole layers of nodes are exactly zero.
  const auto cube = [](const Vec3& p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) - 4; };
  const auto mesh = polygonise(fieldOf(cube), std::vector<Vec3>{{4, 0, 0}}, boxOf(6, 1));
  ASSERT_TRUE(mesh.has_value());
  expectClosedManifold(*mesh);
  EXPECT_EQ(check(*mesh).euler, 2);
  for (const auto& t : mesh->triangles) {
    const Vec3& a = mesh->vertices[t[0]];
    EXPECT_GT(norm(cross(mesh->vertices[t[1]] - a, mesh->vertices[t[2]] - a)), 0);
  }
}

TEST(Polygonise, VisitsOnlyCellsNearTheSurface) {
  std::size_t evaluated = 0;
  Field field = fieldOf([](const Vec3& p) { return norm(p) - 20; });
  const auto inner = field.values;
  field.values = [&](std::span<const Vec3> p, std::span<double> out) { evaluated += p.size(), inner(p, out); };
  const auto mesh = polygonise(field, std::vector<Vec3>{{20, 0, 0}}, boxOf(25, 0.5));
  ASSERT_TRUE(mesh.has_value());
  // The box has a million nodes; the sphere cuts some 30,000 cells.
  EXPECT_LT(evaluated, 5 * mesh->vertices.size());
}

TEST(Polygonise, WorksAKilometreFromTheOrigin) {
  const Vec3 far{1e6, -1e6, 1e6};
  const auto mesh = polygonise(fieldOf([&](const Vec3& p) { return norm(p - far) - 5; }),
                               std::vector<Vec3>{far + Vec3{0, 5, 0}}, {0.5, far - Vec3{6, 6, 6}, far + Vec3{6, 6, 6}});
  ASSERT_TRUE(mesh.has_value());
  expectClosedManifold(*mesh);
  for (const Vec3& v : mesh->vertices) EXPECT_NEAR(norm(v - far), 5, 1e-3);
}

TEST(Polygonise, RefusesASurfaceThatLeavesTheBox) {
  const auto field = fieldOf([](const Vec3& p) { return norm(p) - 10; });
  const auto mesh = polygonise(field, std::vector<Vec3>{{0, 0, 10}}, {0.5, {-12, -12, -12}, {12, 5, 12}});
  ASSERT_FALSE(mesh.has_value());
  EXPECT_NE(mesh.error().message.find("leaves"), std::string::npos);
}

TEST(Polygonise, RefusesWhatHasNoSurfaceAndWhatIsNotFinite) {
  const auto field = fieldOf([](const Vec3& p) { return norm(p) - 10; });
  EXPECT_EQ(polygonise(field, {}, boxOf(12, 1)).error().code, ErrorCode::NotFound);
  EXPECT_EQ(polygonise(field, std::vector<Vec3>{{0, 0, 0}, {99, 0, 0}}, boxOf(12, 1)).error().code,
            ErrorCode::NotFound);
  EXPECT_EQ(polygonise(field, {}, boxOf(12, 0)).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(polygonise(field, {}, boxOf(-1, 1)).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(polygonise(field, {}, boxOf(1e9, 1)).error().code, ErrorCode::Limit);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(polygonise(field, {}, boxOf(12, nan)).error().code, ErrorCode::NotFinite);
  const auto broken = fieldOf([nan](const Vec3& p) { return p.z > 0 ? nan : norm(p) - 10; });
  EXPECT_EQ(polygonise(broken, std::vector<Vec3>{{0, 0, -10}}, boxOf(12, 1)).error().code, ErrorCode::NotFinite);
}

}  // namespace
}  // namespace spinaltap::mesh
