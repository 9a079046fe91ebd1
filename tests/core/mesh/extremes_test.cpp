// The polygoniser where numbers, scales and fields are at their worst.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/random.h"
#include "core/mesh/polygonise.h"
#include "tests/core/mesh/fields.h"

namespace spinaltap::mesh {
namespace {

TEST(PolygoniseExtremes, WorksAHundredThousandKilometresFromTheOrigin) {
  const Vec3 far{1e8, -1e8, 1e8};
  const auto mesh = polygonise(fieldOf([&](const Vec3& p) { return norm(p - far) - 5; }),
                               std::vector<Vec3>{far + Vec3{0, 5, 0}}, {0.5, far - Vec3{6, 6, 6}, far + Vec3{6, 6, 6}});
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  const MeshCheck c = expectSound(*mesh);
  EXPECT_EQ(c.euler, 2);
  for (const Vec3& v : mesh->vertices) EXPECT_NEAR(norm(v - far), 5, 1e-3);
}

TEST(PolygoniseExtremes, GivesTheSameMeshInMetresMillimetresAndMicrometres) {
  // Powers of two, so that nothing but the exponent differs: 2^-10 is about a metre's millimetre.
  const auto meshIn = [](double unit) {
    return polygonise(fieldOf([unit](const Vec3& p) { return torus(p / unit) * unit; }, 1e-5 * unit),
                      std::vector<Vec3>{Vec3{13, 0, 0} * unit}, boxOf(14 * unit, 0.9 * unit));
  };
  const auto mm = meshIn(1);
  ASSERT_TRUE(mm.has_value());
  expectSound(*mm);
  for (const double unit : {0x1p-10, 0x1p10, 0x1p-300, 0x1p300}) {
    const auto other = meshIn(unit);
    ASSERT_TRUE(other.has_value()) << unit << ": " << other.error().message;
    EXPECT_EQ(other->triangles, mm->triangles);
    ASSERT_EQ(other->vertices.size(), mm->vertices.size());
    for (std::size_t v = 0; v < mm->vertices.size(); ++v) {
      ASSERT_EQ(other->vertices[v] / unit, mm->vertices[v]);
      EXPECT_GT(dot(other->normals[v], mm->normals[v]), 0.999999);
    }
  }
}

TEST(PolygoniseExtremes, TakesFieldsWhoseSlopeIsFarFromOne) {
  for (const double slope : {1e-200, 1e-9, 1e9, 1e200}) {
    const auto mesh = polygonise(fieldOf([slope](const Vec3& p) { return slope * torus(p); }),
                                 std::vector<Vec3>{{13, 0, 0}}, boxOf(14, 0.9));
    ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
    EXPECT_EQ(expectSound(*mesh).euler, 0);
    for (const Vec3& v : mesh->vertices) EXPECT_NEAR(torus(v), 0, 1.26e-3 * 0.9);
  }
}

TEST(PolygoniseExtremes, FieldsThatAreExactlyZeroAtNodesGiveSoundMeshes) {
  // A cube whose faces lie on layers of nodes: the box's low corner is one, and nodes are 2^(1/3) cells apart.
  const double cube_mm = 1.2599210498948732;
  const auto cube = [&](const Vec3& p) {
    return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) - 4 * cube_mm;
  };
  for (const double half : {8 * cube_mm, 8.5 * cube_mm}) {
    const auto mesh = polygonise(fieldOf(cube), std::vector<Vec3>{{4 * cube_mm, 0, 0}}, boxOf(half, 1));
    ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
    const MeshCheck c = expectSound(*mesh);
    EXPECT_EQ(c.euler, 2);
    EXPECT_NEAR(c.volume_mm3, std::pow(8 * cube_mm, 3), 0.03 * std::pow(8 * cube_mm, 3));  // edges are cut off
  }
}

TEST(PolygoniseExtremes, WholeRegionsOfZerosAreOutside) {
  const auto flat = [](const Vec3& p) { return std::min(0.0, norm(p) - 5); };  // exactly zero from the sphere outwards
  const auto mesh = polygonise(fieldOf(flat), std::vector<Vec3>{{4.9, 0, 0}}, boxOf(8, 0.6));
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  EXPECT_EQ(expectSound(*mesh).euler, 2);
}

TEST(PolygoniseExtremes, SheetsThinnerThanACellStayApartAndClosed) {
  Random random(4);
  for (const double thickness : {0.9, 0.5, 0.2, 0.05}) {
    const Vec3 across = normalized(Vec3{random.gaussian(), random.gaussian(), random.gaussian()});
    // A lens-shaped sheet: a slab inside a ball.
    const auto sheet = [&](const Vec3& p) { return std::max(std::abs(dot(p, across)) - thickness / 2, norm(p) - 6); };
    std::vector<Vec3> seeds;
    for (int n = 0; n < 4000; ++n) {
      const Vec3 p{random.uniform(-6, 6), random.uniform(-6, 6), random.uniform(-6, 6)};
      seeds.push_back(p - across * (dot(p, across) - thickness / 2));
    }
    const auto mesh = polygonise(fieldOf(sheet), seeds, boxOf(9, 1));
    SCOPED_TRACE(thickness);
    if (!mesh) {  // the thinnest may pass between all nodes
      EXPECT_EQ(mesh.error().code, ErrorCode::NotFound);
      EXPECT_LT(thickness, 0.3);
      continue;
    }
    expectSound(*mesh);
    for (const Vec3& v : mesh->vertices) EXPECT_LT(sheet(v), 0.4);  // what the header allows where it is that thin
  }
}

TEST(PolygoniseExtremes, BallsThatTouchAreJoinedOrKeptApartButNeverPinched) {
  Random random(6);
  for (int n = 0; n < 20; ++n) {
    const Vec3 way = normalized(Vec3{random.gaussian(), random.gaussian(), random.gaussian()});
    const double gap = random.uniform(-0.3, 0.3);
    const auto balls = [&](const Vec3& p) { return std::min(norm(p + way * 3), norm(p - way * (3 + gap))) - 3; };
    const auto mesh = polygonise(fieldOf(balls), std::vector<Vec3>{way * -6, way * (6 + gap)}, boxOf(8, 0.7));
    ASSERT_TRUE(mesh.has_value());
    SCOPED_TRACE(testing::Message() << n << " gap " << gap);
    EXPECT_LE(expectSound(*mesh).parts, 2U);
    for (const Vec3& v : mesh->vertices) EXPECT_NEAR(balls(v), 0, 0.4 * 0.7);  // what the header allows there
  }
}

TEST(PolygoniseExtremes, SpecksAreSoundOrNotThere) {
  Random random(8);
  int found = 0;
  for (int n = 0; n < 300; ++n) {
    const double radius = random.uniform(0.05, 0.8);
    const Vec3 middle{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    const auto mesh = polygonise(fieldOf([&](const Vec3& p) { return norm(p - middle) - radius; }),
                                 std::vector<Vec3>{middle}, boxOf(6, 1));
    if (!mesh) {
      EXPECT_EQ(mesh.error().code, ErrorCode::NotFound);
      EXPECT_LT(radius, 0.71);  // a ball that is farther from all nodes than this does not fit between them
      continue;
    }
    ++found;
    EXPECT_EQ(expectSound(*mesh).euler, 2);
  }
  EXPECT_GT(found, 100);
}

TEST(PolygoniseExtremes, ASurfaceThatLeavesTheBoxIsAnErrorThatSaysWhere) {
  const auto field = fieldOf([](const Vec3& p) { return norm(p) - 10; });
  const auto mesh = polygonise(field, std::vector<Vec3>{{0, 0, 10}}, {0.5, {-12, -12, -12}, {12, 5, 12}});
  ASSERT_FALSE(mesh.has_value());
  EXPECT_EQ(mesh.error().code, ErrorCode::InvalidArgument);
  EXPECT_NE(mesh.error().message.find("leaves the polygonise box at ("), std::string::npos) << mesh.error().message;
  EXPECT_EQ(mesh.error().message.find('\n'), std::string::npos);
  // A plane leaves any box.
  const auto plane = fieldOf([](const Vec3& p) { return p.z + 0.1 * p.x; });
  EXPECT_EQ(polygonise(plane, std::vector<Vec3>{{0, 0, 0}}, boxOf(12, 1)).error().code, ErrorCode::InvalidArgument);
}

/// A vertebra at the edge of the stack has no samples there, and the field ends it beyond in some way of its own.
TEST(PolygoniseExtremes, WhatIsCutOffByTheVolumeIsClosedByTheFieldOrReported) {
  const auto ball_cut = [](const Vec3& p) { return std::max(norm(p) - 10, p.z - 4); };  // a field that closes it flat
  const auto closed =
      polygonise(fieldOf(ball_cut), std::vector<Vec3>{{0, 0, -10}}, {0.7, {-12, -12, -12}, {12, 12, 6}});
  ASSERT_TRUE(closed.has_value()) << closed.error().message;
  EXPECT_EQ(expectSound(*closed).euler, 2);
  const auto ball = [](const Vec3& p) { return norm(p) - 10; };  // and one that goes on
  const auto open = polygonise(fieldOf(ball), std::vector<Vec3>{{0, 0, -10}}, {0.7, {-12, -12, -12}, {12, 12, 6}});
  EXPECT_EQ(open.error().code, ErrorCode::InvalidArgument);
}

TEST(PolygoniseExtremes, RefusesWhatHasNoSurfaceAndWhatIsNotFinite) {
  const auto field = fieldOf([](const Vec3& p) { return norm(p) - 10; });
  const std::vector<Vec3> none;
  EXPECT_EQ(polygonise(field, none, boxOf(12, 1)).error().code, ErrorCode::NotFound);
  EXPECT_EQ(polygonise(field, std::vector<Vec3>{{0, 0, 0}, {1e300, 0, 0}}, boxOf(12, 1)).error().code,
            ErrorCode::NotFound);
  EXPECT_EQ(polygonise(field, none, boxOf(12, 0)).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(polygonise(field, none, boxOf(-1, 1)).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(polygonise(field, none, boxOf(1e9, 1)).error().code, ErrorCode::Limit);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(polygonise(field, none, boxOf(12, nan)).error().code, ErrorCode::NotFinite);
  EXPECT_EQ(polygonise(field, std::vector<Vec3>{{nan, 0, 0}}, boxOf(12, 1)).error().code, ErrorCode::NotFinite);
}

TEST(PolygoniseExtremes, SaysWhereTheFieldIsNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto broken = fieldOf([nan](const Vec3& p) { return p.z > 0 ? nan : norm(p) - 10; });
  const auto mesh = polygonise(broken, std::vector<Vec3>{{0, 0, -10}}, boxOf(12, 1));
  ASSERT_FALSE(mesh.has_value());
  EXPECT_EQ(mesh.error().code, ErrorCode::NotFinite);
  EXPECT_NE(mesh.error().message.find("not finite at ("), std::string::npos) << mesh.error().message;
  // Between the nodes, where crossings are looked for, and in the gradients.
  auto field = fieldOf([](const Vec3& p) { return norm(p) - 10; });
  int calls = 0;
  field.values = [&, inner = field.values](std::span<const Vec3> p, std::span<double> out) {
    inner(p, out);
    if (++calls > 24) out[0] = nan;  // waves from one seed around a sphere of 20 cells take fewer than 40
  };
  EXPECT_EQ(polygonise(field, std::vector<Vec3>{{0, 0, 10}}, boxOf(12, 1)).error().code, ErrorCode::NotFinite);
  field = fieldOf([](const Vec3& p) { return norm(p) - 10; });
  field.gradients = [nan](std::span<const Vec3> p, std::span<Vec3> out) {
    for (std::size_t i = 0; i < p.size(); ++i) out[i] = {0, 0, nan};
  };
  EXPECT_EQ(polygonise(field, std::vector<Vec3>{{0, 0, 10}}, boxOf(12, 1)).error().code, ErrorCode::NotFinite);
}

TEST(PolygoniseExtremes, NormalsAreOutwardWhereTheGradientVanishes) {
  auto field = fieldOf([](const Vec3& p) { return norm(p) - 5; });
  field.gradients = [](std::span<const Vec3> p, std::span<Vec3> out) {
    for (std::size_t i = 0; i < p.size(); ++i) out[i] = p[i].x > 0 ? Vec3{} : -p[i];  // none, or the wrong way
  };
  const auto mesh = polygonise(field, std::vector<Vec3>{{0, 0, 5}}, boxOf(6, 0.7));
  ASSERT_TRUE(mesh.has_value());
  for (std::size_t v = 0; v < mesh->vertices.size(); ++v) {
    EXPECT_GT(dot(mesh->normals[v], normalized(mesh->vertices[v])), 0.97);
  }
}

}  // namespace
}  // namespace spinaltap::mesh
