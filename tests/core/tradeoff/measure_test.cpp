#include "core/tradeoff/measure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/base/dmath.h"
#include "core/base/random.h"
#include "core/mesh/polygonise.h"
#include "core/phantom/ct.h"

namespace spinaltap::tradeoff {
namespace {

/// s = scale * (|p| - radius): not a distance unless scale is 1, so feet have to be found.
Field ball(double radius, double scale = 1) {
  Field f;
  f.values = [=](std::span<const Vec3> points, std::span<double> out) {
    for (std::size_t i = 0; i < points.size(); ++i) out[i] = scale * (norm(points[i]) - radius);
  };
  f.gradients = [=](std::span<const Vec3> points, std::span<Vec3> out) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      out[i] = norm(points[i]) > 0 ? normalized(points[i]) * scale : Vec3{};
    }
  };
  f.lipschitz = scale;
  return f;
}

mesh::TriangleMesh ballMesh(double radius, double cell_mm) {
  const Vec3 seed{radius, 0, 0}, corner = Vec3{1, 1, 1} * (radius + 2 * cell_mm);
  return *mesh::polygonise(ball(radius), {&seed, 1}, {cell_mm, corner * -1.0, corner});
}

TEST(Summarise, GivesSignedMeanAndSizesOtherwise) {
  std::vector<double> values;
  for (int n = 1; n <= 100; ++n) values.push_back(n % 2 == 0 ? n : -n);
  const Distances d = summarise(values);
  EXPECT_EQ(d.count, 100U);
  EXPECT_DOUBLE_EQ(d.mean_mm, 0.5);
  EXPECT_DOUBLE_EQ(d.rms_mm, std::sqrt(101 * 201 / 6.0));  // the sum of squares to n is n (n + 1) (2 n + 1) / 6
  EXPECT_EQ(d.p95_mm, 95);
  EXPECT_EQ(d.p99_mm, 99);
  EXPECT_EQ(d.most_mm, 100);
  EXPECT_EQ(summarise({}).count, 0U);
}

TEST(PointsOn, ArePutByAreaAndInsideTheirTriangles) {
  mesh::TriangleMesh two;
  two.vertices = {{0, 0, 0}, {2, 0, 0}, {0, 1, 0}, {10, 0, 0}, {16, 0, 0}, {10, 1, 0}};
  two.triangles = {{0, 1, 2}, {3, 4, 5}};
  const auto points = pointsOn(two, 4000, 5);
  ASSERT_EQ(points.size(), 4000U);
  std::size_t first = 0;
  for (const Vec3& p : points) {
    const bool in_first = p.x < 5;
    first += in_first ? 1 : 0;
    EXPECT_EQ(p.z, 0);
    EXPECT_GE(p.y, 0);
    EXPECT_LE(in_first ? p.x / 2 + p.y : (p.x - 10) / 6 + p.y, 1 + 1e-12);
  }
  // A quarter; five standard deviations of 4000 draws are 137.
  EXPECT_NEAR(static_cast<double>(first), 1000, 137);
  EXPECT_EQ(points, pointsOn(two, 4000, 5)) << "one seed, one choice";
}

TEST(FromTruth, MeasuresAMeshThatIsMovedOutwardsByThatMuch) {
  const auto truth = phantom::Phantom::make({});
  mesh::TriangleMesh moved;
  for (const Vec3& p : pointsOfTruth(truth, 200, 3)) {
    const Vec3 n = normalized(truth.gradient(p)), at = p + n * 0.05;
    const Vec3 a = normalized(cross(n, std::abs(n.x) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0})) * 1e-3, b = cross(n, a);
    const auto first = static_cast<std::uint32_t>(moved.vertices.size());
    moved.vertices.insert(moved.vertices.end(), {at, at + a, at + b});
    moved.triangles.push_back({first, first + 1, first + 2});
  }
  const Distances d = fromTruth(moved, truth, 500, 7);
  EXPECT_EQ(d.count, 500U);
  // The triangles are flat where the bone is not: 1e-6 / 2 over a radius of a millimetre.
  EXPECT_NEAR(d.mean_mm, 0.05, 1e-4);
  EXPECT_NEAR(d.most_mm, 0.05, 1e-3);
}

TEST(ToSurface, FindsTheFootOfAFieldThatIsNoDistance) {
  const std::vector<Vec3> points{{5.5, 0, 0}, {0, 4, 0}, {0, 0, -5}, {3, 4, 0}};
  const Distances d = toSurface(ball(5, 3), points, 20);
  EXPECT_NEAR(d.most_mm, 1, 1e-9);
  EXPECT_NEAR(d.mean_mm, (0.5 - 1) / 4, 1e-9) << "outside is positive";
}

TEST(ToSurface, APointThatHasNoFootNearCountsWithTheMost) {
  Field nothing;
  nothing.values = [](std::span<const Vec3> p, std::span<double> out) { std::fill_n(out.begin(), p.size(), 7.0); };
  nothing.gradients = [](std::span<const Vec3> p, std::span<Vec3> out) { std::fill_n(out.begin(), p.size(), Vec3{}); };
  EXPECT_EQ(toSurface(nothing, {{0, 0, 0}}, 3).rms_mm, 3);
  EXPECT_EQ(toSurface(ball(5), {{30, 0, 0}}, 20).rms_mm, 20);
}

TEST(SidesOf, NoneIsWrongForTheTruthAndAllForItsOpposite) {
  const auto truth = phantom::Phantom::make({});
  const Sides right = sidesOf(truth.field(), truth, 0.35, 2000, 9);
  EXPECT_GT(right.asked, 1500U);
  EXPECT_EQ(right.wrong, 0U);
  Field opposite = truth.field();
  opposite.values = [field = truth.field()](std::span<const Vec3> points, std::span<double> out) {
    field.values(points, out);
    for (double& v : out) v = -v;
  };
  const Sides wrong = sidesOf(opposite, truth, 0.35, 2000, 9);
  EXPECT_EQ(wrong.asked, right.asked);
  EXPECT_EQ(wrong.wrong, wrong.asked);
}

TEST(SidesOf, LooksOnlyBeyondTheMargin) {
  const auto truth = phantom::Phantom::make({});
  Field thinner = truth.field();  // by 0.2 mm, all round
  thinner.values = [&truth](std::span<const Vec3> points, std::span<double> out) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      out[i] = std::abs(truth.signedDistance(points[i])) > 1 ? truth.signedDistance(points[i])
                                                             : truth.distanceToSurface(points[i]) + 0.2;
    }
  };
  EXPECT_EQ(sidesOf(thinner, truth, 0.35, 2000, 11).wrong, 0U);
  EXPECT_GT(sidesOf(thinner, truth, 0.01, 2000, 11).wrong, 0U);
}

TEST(Roughness, IsThatOfTheNoiseAndNotOfTheShape) {
  mesh::TriangleMesh smooth = ballMesh(8, 0.6);
  // A quadric misses a ball of radius R at a distance r from its middle by about r^4 / (8 R^3); the ridge that keeps
  // few points from bending it leaves a tenth of the curvature's own height, r^2 / (2 R), at most.
  const double r = kRoughnessRadius_mm;
  EXPECT_LT(roughnessOf(smooth), std::pow(r, 4) / (8 * 512) + 0.1 * r * r / 16);
  Random random(41);
  mesh::TriangleMesh rough = smooth, rougher = smooth;
  for (std::size_t i = 0; i < smooth.vertices.size(); ++i) {
    const double height = 0.03 * random.gaussian();
    rough.vertices[i] += smooth.normals[i] * height;
    rougher.vertices[i] += smooth.normals[i] * (2 * height);
  }
  // The quadric has five or six coefficients for some thirty vertices: it takes up to a fifth of the variance.
  EXPECT_LT(roughnessOf(rough), 0.031);
  EXPECT_GT(roughnessOf(rough), 0.03 * std::sqrt(0.75));
  EXPECT_NEAR(roughnessOf(rougher) / roughnessOf(rough), 2, 0.1);
  EXPECT_EQ(roughnessOf({}), 0);
}

TEST(VolumeOf, AMeshIsThatOfItsBallWhereverItIs) {
  mesh::TriangleMesh near = ballMesh(8, 0.5);
  const double exact = 4.0 / 3 * kPi * 512;
  // Chords of up to 0.6 mm lie 0.6^2 / (8 * 8) = 0.006 mm inside at most: 3 * 0.006 / 8 of the volume.
  EXPECT_LT(volumeOf(near), exact);
  EXPECT_GT(volumeOf(near), exact * (1 - 3 * 0.006 / 8));
  const double here = volumeOf(near);
  for (Vec3& v : near.vertices) v += Vec3{1e8, -1e8, 1e8};
  // Each coordinate is rounded by 7.5e-9 mm: on 804 mm^2, far below a cubic micrometre's thousandth.
  EXPECT_NEAR(volumeOf(near), here, 1e-5);
  EXPECT_EQ(volumeOf(mesh::TriangleMesh{}), 0);
}

/// The slow twin asks every cell.
TEST(VolumeOf, ThePhantomIsWhatCountingEveryCellGives) {
  const auto truth = phantom::Phantom::make({});
  const auto bounds = truth.bounds();
  volume::Grid grid;
  const double cell = 1.0;
  grid.spacing_mm = {cell, cell, cell};
  grid.origin_patient = bounds.low_patient;
  const Vec3 size = (bounds.high_patient - bounds.low_patient) / cell;
  grid.dims = {static_cast<int>(size.x) + 1, static_cast<int>(size.y) + 1, static_cast<int>(size.z) + 1};
  const auto label = phantom::truthLabel(truth, grid);
  EXPECT_EQ(volumeOf(truth, cell), static_cast<double>(std::count(label.inside.begin(), label.inside.end(), 1)));
}

}  // namespace
}  // namespace spinaltap::tradeoff
