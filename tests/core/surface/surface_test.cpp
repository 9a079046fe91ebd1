#include "core/surface/surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/dmath.h"
#include "core/base/random.h"
#include "core/surface/neighbours.h"
#include "tests/core/surface/ball.h"

namespace spinaltap::surface {
namespace {

TEST(FindBoundary, MeetsTheEdgeOfTheCtFarBetterThanAVoxel) {
  const Ball ball;
  const Scan s = scan(gridAround({0, 0, 0}, {0.5, 0.5, 0.5}, 18), ball);
  const auto points = findBoundary(s.ct, s.label);
  ASSERT_TRUE(points.has_value()) << points.error().message;
  const Errors e = errorsOf(*points, ball);
  // Interpolating a ramp of 1 mm on voxels of 0.5: its corners are cut by less than h/8 = 0.06 mm.
  EXPECT_LT(e.rms, 0.06);
  EXPECT_LT(e.worst, 0.15);
  EXPECT_GT(e.worst_cosine, 0.98);
  EXPECT_EQ(points->from_ct, points->normals.size());
}

TEST(FindBoundary, WorksInAnObliqueAnisotropicStackAKilometreAway) {
  Ball ball;
  ball.middle = {1e6, -1e6, 1e6};
  const Scan s = scan(gridAround(ball.middle, {0.4, 0.6, 1.2}, 18, turned()), ball);
  const auto points = findBoundary(s.ct, s.label);
  ASSERT_TRUE(points.has_value()) << points.error().message;
  const Errors e = errorsOf(*points, ball);
  // The ramp is shorter than the longest voxel side, so a quarter of that is what interpolation can lose at worst.
  EXPECT_LT(e.rms, 0.15);
  EXPECT_LT(e.worst, 0.4);
  EXPECT_GT(e.worst_cosine, 0.95);
}

TEST(FindBoundary, CorrectsALabelThatIsAVoxelTooLarge) {
  const Ball ball;
  Scan s = scan(gridAround({0, 0, 0}, {0.5, 0.5, 0.5}, 18), ball);
  Ball larger = ball;
  larger.radius += 0.5;
  s.label = scan(s.ct.grid, larger).label;
  const auto points = findBoundary(s.ct, s.label);
  ASSERT_TRUE(points.has_value());
  EXPECT_LT(errorsOf(*points, ball).rms, 0.06);
}

TEST(FindBoundary, FallsBackToTheLabelWhereTheCtHasNoEdge) {
  Ball ball;
  ball.inside_hu = ball.outside_hu = 40;
  const Scan s = scan(gridAround({0, 0, 0}, {0.5, 0.5, 0.5}, 18), ball);
  const auto points = findBoundary(s.ct, s.label);
  ASSERT_TRUE(points.has_value());
  EXPECT_EQ(points->from_ct, 0U);
  // The voxels of a ball place its boundary to half a voxel; smoothing averages most of that.
  EXPECT_LT(errorsOf(*points, ball).rms, 0.15);
}

TEST(FindBoundary, ABoneOnAZeroBackgroundHasItsEdge) {
  Ball ball;
  ball.outside_hu = 0;
  const Scan s = scan(gridAround({0, 0, 0}, {1, 1, 1}, 18), ball);
  const auto points = findBoundary(s.ct, s.label);
  ASSERT_TRUE(points.has_value());
  EXPECT_LT(errorsOf(*points, ball).rms, 0.15);
}

TEST(FindBoundary, PointsAreSpacedAndCoverTheSurface) {
  const Ball ball;
  const Scan s = scan(gridAround({0, 0, 0}, {0.5, 0.5, 0.5}, 18), ball);
  const auto points = findBoundary(s.ct, s.label);
  ASSERT_TRUE(points.has_value());
  const double area = 4 * kPi * ball.radius * ball.radius;
  const double count = static_cast<double>(points->normals.size());
  // Between a packing of discs of the spacing's radius (1.15 a mm^2 at most) and a covering by discs of the spacing.
  EXPECT_LT(count, 1.2 * area);
  EXPECT_GT(count, 0.38 * area);
  Random random(31);
  for (int n = 0; n < 300; ++n) {
    const Vec3 d{random.gaussian(), random.gaussian(), random.gaussian()};
    const Vec3 p = normalized(d) * ball.radius;
    double nearest = 1e9;
    for (const Vec3& q : points->positions_patient) nearest = std::min(nearest, norm(p - q));
    EXPECT_LT(nearest, 1.5 * kSampleSpacing_mm) << "seed 31, case " << n;
  }
}

TEST(FindBoundary, RefusesWhatDoesNotFit) {
  const Scan s = scan(gridAround({0, 0, 0}, {1, 1, 1}, 15), Ball{});
  LabelVolume empty = s.label;
  std::fill(empty.inside.begin(), empty.inside.end(), std::uint8_t{0});
  EXPECT_EQ(findBoundary(s.ct, empty).error().code, ErrorCode::NotFound);
  LabelVolume moved = s.label;
  moved.grid.origin_patient.x += 1;
  EXPECT_EQ(findBoundary(s.ct, moved).error().code, ErrorCode::InvalidArgument);
  BoundaryOptions o;
  o.spacing_mm = 0;
  EXPECT_EQ(findBoundary(s.ct, s.label, o).error().code, ErrorCode::InvalidArgument);
  o = {};
  o.minimum_contrast_hu = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(findBoundary(s.ct, s.label, o).error().code, ErrorCode::InvalidArgument);
}

TEST(MakeSamples, OffSurfaceSamplesHaveTheirOwnPointAsTheNearest) {
  // Two facing sheets 1.2 mm apart: full offsets of 1 mm would cross over to the other.
  OrientedPoints points;
  for (int i = 0; i < 20; ++i) {
    for (int j = 0; j < 20; ++j) {
      points.positions_patient.push_back({1.0 * i, 1.0 * j, 0});
      points.normals.push_back({0, 0, 1});
      points.positions_patient.push_back({1.0 * i, 1.0 * j, 1.2});
      points.normals.push_back({0, 0, -1});
    }
  }
  const auto samples = makeSamples(points, 1.0);
  ASSERT_TRUE(samples.has_value());
  std::size_t shortened = 0, whole = 0;
  for (std::size_t s = points.normals.size(); s < samples->positions.size(); ++s) {
    const double distance = std::abs(samples->distances_mm[s]);
    for (const Vec3& p : points.positions_patient) {
      EXPECT_GE(norm(p - samples->positions[s]), distance * (1 - 1e-5));
    }
    (distance == 1.0 ? whole : shortened) += 1;
    if (samples->distances_mm[s] > 0) {
      EXPECT_NEAR(distance, 0.48, 1e-12);  // between the sheets: 0.8 of the ball of 0.6 that fits
    }
  }
  EXPECT_EQ(shortened, 800U);
  EXPECT_EQ(whole, 800U);
}

TEST(MakeSamples, DropsASampleThatWouldNeedATinyOffset) {
  OrientedPoints points;
  points.positions_patient = {{0, 0, 0}, {0, 0, 0.1}, {5, 0, 0}};
  points.normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
  const auto samples = makeSamples(points, 1.0);
  ASSERT_TRUE(samples.has_value());
  EXPECT_EQ(samples->positions.size(), 3U + 2U + 2U);  // between the close pair there is no room on either side
}

/// The slow twin: every other point asked.
TEST(MakeSamples, AreAsFarAsTheLargestEmptyBallLets) {
  Random random(35);
  OrientedPoints points;
  for (int i = 0; i < 300; ++i) {
    points.positions_patient.push_back({random.uniform(0, 6), random.uniform(0, 6), random.uniform(0, 6)});
    points.normals.push_back(normalized({random.gaussian(), random.gaussian(), random.gaussian()}));
  }
  const auto samples = makeSamples(points, 1.0);
  ASSERT_TRUE(samples.has_value());
  std::size_t next = points.normals.size();
  for (std::size_t i = 0; i < points.normals.size(); ++i) {
    for (const double side : {1.0, -1.0}) {
      double ball = 1.25;
      for (std::size_t n = 0; n < points.normals.size(); ++n) {
        const Vec3 d = points.positions_patient[n] - points.positions_patient[i];
        const double along = side * dot(d, points.normals[i]);
        if (n != i && along > 0) ball = std::min(ball, dot(d, d) / (2 * along));
      }
      if (0.8 * ball < 0.1) continue;
      ASSERT_LT(next, samples->positions.size()) << "seed 35, point " << i;
      EXPECT_NEAR(samples->distances_mm[next], side * 0.8 * ball, 1e-12) << "seed 35, point " << i;
      ++next;
    }
  }
  EXPECT_EQ(next, samples->positions.size());
}

TEST(MakeSamples, APointWithoutANormalIsOnTheSurfaceAndNothingElse) {
  OrientedPoints points;
  points.positions_patient = {{0, 0, 0}, {5, 0, 0}};
  points.normals = {{0, 0, 0}, {0, 0, 1}};
  const auto samples = makeSamples(points, 1.0);
  ASSERT_TRUE(samples.has_value());
  EXPECT_EQ(samples->positions.size(), 2U + 2U);
}

TEST(MakeSamples, RefusesNothingAndNonsense) {
  EXPECT_EQ(makeSamples({}, 1.0).error().code, ErrorCode::Degenerate);
  OrientedPoints points;
  points.positions_patient = {{0, 0, 0}};
  EXPECT_EQ(makeSamples(points, 1.0).error().code, ErrorCode::InvalidArgument);
  points.normals = {{0, 0, 1}};
  EXPECT_EQ(makeSamples(points, 0).error().code, ErrorCode::InvalidArgument);
  points.normals[0].x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(makeSamples(points, 1.0).error().code, ErrorCode::NotFinite);
}

/// The slow twin: every point asked.
TEST(Neighbours, FindsExactlyThePointsWithinTheRadius) {
  Random random(33);
  std::vector<Vec3> points;
  for (int i = 0; i < 500; ++i) points.push_back({random.uniform(0, 9), random.uniform(0, 5), random.uniform(0, 30)});
  points.push_back({1e6, 0, 0});  // a stray one must not cost memory
  const Neighbours near(points, 0.5);
  for (int n = 0; n < 200; ++n) {
    const Vec3 p{random.uniform(-2, 11), random.uniform(-2, 7), random.uniform(-2, 32)};
    const double radius = random.uniform(0, 4);
    std::vector<std::size_t> fast, slow;
    near.eachWithin(p, radius, [&](std::size_t i) { fast.push_back(i); });
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec3 d = points[i] - p;
      if (dot(d, d) <= radius * radius) slow.push_back(i);
    }
    std::sort(fast.begin(), fast.end());
    EXPECT_EQ(fast, slow) << "seed 33, case " << n;
  }
}

}  // namespace
}  // namespace spinaltap::surface
