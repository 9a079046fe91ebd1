// The files read back by independent readers; the error of simplification against brute force.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/random.h"
#include "core/phantom/phantom.h"
#include "server/mesh_out/mesh_file.h"
#include "server/mesh_out/simplify.h"
#include "server/mesh_out/within.h"
#include "tests/core/mesh/fields.h"
#include "tests/server/mesh_out/mesh_readers.h"

namespace spinaltap::mesh_out {
namespace {

using mesh::TriangleMesh;

TriangleMesh torusMesh(double cell, const Vec3& at = {}) {
  return mesh::polygonise(mesh::fieldOf([at](const Vec3& p) { return mesh::torus(p - at); }),
                          std::vector<Vec3>{at + Vec3{13, 0, 0}}, {cell, at - Vec3{15, 15, 15}, at + Vec3{15, 15, 15}})
      .value();
}

TEST(MeshFile, AnStlReadBackIsTheSameClosedSurface) {
  const TriangleMesh mesh = torusMesh(0.8, {120.5, -340.25, 1020.75});
  const auto bytes = encode(mesh, Format::Stl);
  ASSERT_TRUE(bytes.has_value());
  EXPECT_EQ(bytes->size(), 84 + 50 * mesh.triangles.size());
  const test::ReadMesh read = test::readStl(*bytes);
  EXPECT_NE(read.head.rfind("solid", 0), 0U) << "readers take that for text";
  EXPECT_NE(read.head.find("millimetres"), std::string::npos);
  EXPECT_NE(read.head.find("LPS"), std::string::npos);
  ASSERT_EQ(read.mesh.triangles.size(), mesh.triangles.size());
  const mesh::MeshCheck before = mesh::check(mesh), after = mesh::check(read.mesh);
  EXPECT_EQ(after.open_edges + after.repeated_edges + after.pinched_vertices, 0U);
  EXPECT_EQ(after.euler, before.euler);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    std::array<Vec3, 3> p;
    for (std::size_t n = 0; n < 3; ++n) {
      p[n] = read.mesh.vertices[read.mesh.triangles[t][n]];
      EXPECT_LT(norm(p[n] - mesh.vertices[mesh.triangles[t][n]]), 1e-4);  // floats up to 1024 are 6e-5 apart
    }
    EXPECT_GT(dot(read.facet_normals[t], cross(p[1] - p[0], p[2] - p[0])), 0);
    EXPECT_NEAR(norm(read.facet_normals[t]), 1, 1e-6);
  }
}

TEST(MeshFile, APlyReadBackHasTheVerySameNumbers) {
  const TriangleMesh mesh = torusMesh(0.8, {1e8, -1e8, 1e8});
  const auto bytes = encode(mesh, Format::Ply);
  ASSERT_TRUE(bytes.has_value());
  const test::ReadMesh read = test::readPly(*bytes);
  EXPECT_EQ(read.head.rfind("ply\nformat binary_little_endian 1.0\n", 0), 0U);
  EXPECT_NE(read.head.find("millimetres"), std::string::npos);
  EXPECT_NE(read.head.find("LPS"), std::string::npos);
  EXPECT_EQ(read.mesh.vertices, mesh.vertices);
  EXPECT_EQ(read.mesh.triangles, mesh.triangles);
  for (std::size_t v = 0; v < mesh.normals.size(); ++v) {
    EXPECT_LT(norm(read.mesh.normals[v] - mesh.normals[v]), 1e-6);
  }
}

TEST(MeshFile, RefusesAnStlThatSinglePrecisionWouldSpoil) {
  const TriangleMesh far = torusMesh(2, {1e5, 0, 0});
  const auto bytes = encode(far, Format::Stl);
  ASSERT_FALSE(bytes.has_value());
  EXPECT_EQ(bytes.error().code, ErrorCode::Limit);
  EXPECT_NE(bytes.error().message.find("PLY"), std::string::npos);
}

TEST(MeshFile, EmptyMeshesAndUnknownFormatsHaveTheirAnswers) {
  EXPECT_TRUE(test::readStl(encode({}, Format::Stl).value()).mesh.triangles.empty());
  EXPECT_TRUE(test::readPly(encode({}, Format::Ply).value()).mesh.triangles.empty());
  EXPECT_EQ(formatNamed("obj").error().code, ErrorCode::InvalidArgument);
  for (const Format format : {Format::Stl, Format::Ply}) EXPECT_EQ(formatNamed(nameOf(format)).value(), format);
}

TEST(SquaredDistance, AgreesWithTheNearestOfManyPointsOfTheTriangle) {
  Random random(21);
  const auto any = [&] { return Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)}; };
  for (int n = 0; n < 300; ++n) {
    const Vec3 a = any(), b = any(), c = any(), p = any() * 2;
    double least = 1e9;
    const int steps = 60;
    for (int i = 0; i <= steps; ++i)
      for (int j = 0; i + j <= steps; ++j) {
        least = std::min(least, norm(p - (a * i + b * j + c * (steps - i - j)) / steps));
      }
    const double distance = std::sqrt(squaredDistance(p, a, b, c));
    EXPECT_LE(distance, least + 1e-12);
    EXPECT_GE(distance, least - 3.5 / steps);  // the triangle's edges are below 2 * 3^0.5
  }
}

std::vector<Vec3> pointsOn(const TriangleMesh& mesh, std::size_t count, Random& random) {
  std::vector<Vec3> out;
  for (std::size_t n = 0; n < count; ++n) {
    const auto& t = mesh.triangles[random.below(mesh.triangles.size())];
    double a = random.unit(), b = random.unit();
    if (a + b > 1) a = 1 - a, b = 1 - b;
    out.push_back(mesh.vertices[t[0]] * (1 - a - b) + mesh.vertices[t[1]] * a + mesh.vertices[t[2]] * b);
  }
  return out;
}

/// Every triangle, every time.
double farthest(const std::vector<Vec3>& points, const TriangleMesh& mesh) {
  double most = 0;
  for (const Vec3& p : points) {
    double least = std::numeric_limits<double>::infinity();
    for (const auto& t : mesh.triangles) {
      least = std::min(least, squaredDistance(p, mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]));
    }
    most = std::max(most, std::sqrt(least));
  }
  return most;
}

TEST(FarTriangles, AreThoseWithAPointOutOfReachAndNoOthers) {
  // A plane of two triangles beside a plane that dips by 0.1 in the middle of one triangle only.
  TriangleMesh flat, dented;
  flat.vertices = {{0, 0, 0}, {10, 0, 0}, {10, 10, 0}, {0, 10, 0}};
  flat.triangles = {{0, 1, 2}, {0, 2, 3}};
  dented = flat;
  dented.vertices.push_back({7, 3, -0.1});
  dented.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 0, 4}, {0, 2, 3}};
  using List = std::vector<std::uint32_t>;
  EXPECT_EQ(farTriangles(dented, {flat, 0.11}, 0.11), List());
  EXPECT_EQ(farTriangles(flat, {dented, 0.11}, 0.11), List());
  EXPECT_EQ(farTriangles(dented, {flat, 0.09}, 0.09), (List{0, 1, 2}));
  EXPECT_EQ(farTriangles(flat, {dented, 0.09}, 0.09), List{0}) << "its corners are on the other, its middle is not";
}

struct Simplified {
  const char* name;
  TriangleMesh mesh;
};

std::vector<Simplified> meshesToSimplify() {
  const auto phantom = phantom::Phantom::make({.seed = 2});
  const Vec3 margin{2, 2, 2};
  auto bone = mesh::polygonise(phantom.field(), std::vector<Vec3>{phantom.pedicle(phantom::Side::Left).entry_patient},
                               {1.2, phantom.bounds().low_patient - margin, phantom.bounds().high_patient + margin});
  const auto rough = [](const Vec3& p) { return mesh::torus(p) + 0.2 * std::sin(5 * p.x) * std::sin(4 * p.y + p.z); };
  auto rippled =
      mesh::polygonise(mesh::fieldOf(rough), std::vector<Vec3>{{13, 0, 0}, {-13, 0, 0}}, mesh::boxOf(15, 0.4));
  return {{"phantom", std::move(bone).value()}, {"rippled torus", std::move(rippled).value()}};
}

/// Facing against the corners' normals; a surface rougher than its cells has a few from the start.
std::size_t countFolded(const TriangleMesh& mesh) {
  return static_cast<std::size_t>(std::count_if(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& t) {
    const Vec3& a = mesh.vertices[t[0]];
    const Vec3 facing = cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a);
    return !(dot(facing, mesh.normals[t[0]] + mesh.normals[t[1]] + mesh.normals[t[2]]) > 0);
  }));
}

TEST(Simplify, KeepsItsErrorBothWaysAndAClosedManifold) {
  Random random(31);
  for (const Simplified& given : meshesToSimplify()) {
    const mesh::MeshCheck before = mesh::check(given.mesh);
    std::size_t last = given.mesh.triangles.size();
    for (const double error_mm : {0.05, 0.2, 0.5}) {
      SCOPED_TRACE(testing::Message() << given.name << ", " << error_mm << " mm");
      const auto made = simplify(given.mesh, error_mm);
      ASSERT_TRUE(made.has_value()) << made.error().message;
      const mesh::MeshCheck after = mesh::check(*made);
      EXPECT_EQ(after.open_edges, 0U);
      EXPECT_EQ(after.repeated_edges, 0U);
      EXPECT_EQ(after.pinched_vertices, 0U);
      EXPECT_EQ(after.euler, before.euler);
      EXPECT_EQ(after.parts, before.parts);
      EXPECT_NEAR(after.volume_mm3, before.volume_mm3, error_mm * before.area_mm2);
      ASSERT_EQ(made->normals.size(), made->vertices.size());
      EXPECT_LE(countFolded(*made), countFolded(given.mesh));
      const double out = farthest(pointsOn(*made, 500, random), given.mesh);
      const double back = farthest(pointsOn(given.mesh, 500, random), *made);
      EXPECT_LE(out, error_mm);
      EXPECT_LE(back, error_mm);
      EXPECT_LT(made->triangles.size(), last) << "a larger error leaves fewer";
      std::printf("  %s, %.2f mm: %zu of %zu triangles, %.3f and %.3f mm found\n", given.name, error_mm,
                  made->triangles.size(), given.mesh.triangles.size(), out, back);
      last = made->triangles.size();
    }
  }
}

TEST(Simplify, GivesTheSameMeshEveryTime) {
  const TriangleMesh mesh = torusMesh(0.8);
  const auto a = simplify(mesh, 0.1), b = simplify(mesh, 0.1);
  EXPECT_EQ(a->vertices, b->vertices);
  EXPECT_EQ(a->triangles, b->triangles);
}

TEST(Simplify, KeepsEveryPart) {
  const auto two = [](const Vec3& p) { return std::min(norm(p - Vec3{6, 0, 0}) - 1, norm(p + Vec3{4, 0, 0}) - 4); };
  const auto both =
      mesh::polygonise(mesh::fieldOf(two), std::vector<Vec3>{{7, 0, 0}, {-8, 0, 0}}, mesh::boxOf(10, 0.3));
  ASSERT_TRUE(both.has_value());
  for (const double error_mm : {0.1, 2.0}) {
    const auto made = simplify(*both, error_mm);
    ASSERT_TRUE(made.has_value());
    EXPECT_EQ(mesh::check(*made).parts, 2U) << error_mm;
  }
}

TEST(Simplify, HoldsFarFromTheOrigin) {
  const TriangleMesh mesh = torusMesh(0.8, {1e8, 1e8, -1e8});
  const auto made = simplify(mesh, 0.1);
  ASSERT_TRUE(made.has_value());
  EXPECT_LT(made->triangles.size(), mesh.triangles.size() * 2 / 3);
  EXPECT_EQ(mesh::check(*made).euler, 0);
}

TEST(Simplify, RefusesErrorsThatMakeNoSenseAndLeavesAnEmptyMeshEmpty) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double wrong : {0.0, -1.0, 1e-4, 11.0, nan}) {
    EXPECT_EQ(simplify(torusMesh(2), wrong).error().code, ErrorCode::InvalidArgument) << wrong;
  }
  EXPECT_TRUE(simplify({}, 0.1)->triangles.empty());
}

}  // namespace
}  // namespace spinaltap::mesh_out
