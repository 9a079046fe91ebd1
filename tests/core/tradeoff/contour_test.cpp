#include "core/tradeoff/contour.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/base/dmath.h"

namespace spinaltap::tradeoff {
namespace {

Field fieldOf(double (*value)(const Vec3&)) {
  Field f;
  f.values = [value](std::span<const Vec3> points, std::span<double> out) {
    std::transform(points.begin(), points.end(), out.begin(), value);
  };
  return f;
}

Plane window() { return {{-10, -10, 0}, {1, 0, 0}, {0, 1, 0}, 20, 20}; }

double around(const Polyline& line) {
  double length = 0;
  for (std::size_t n = 1; n < line.size(); ++n) {
    length += std::hypot(line[n][0] - line[n - 1][0], line[n][1] - line[n - 1][1]);
  }
  return length;
}

TEST(Contour, OfABallIsOneClosedCircle) {
  const auto lines = contourOf(fieldOf([](const Vec3& p) { return norm(p) - 6; }), window(), 0.25);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0].front(), lines[0].back());
  for (const auto& p : lines[0]) {
    // Linear interpolation of a function of curvature 1/r along a side h: at most h^2 / (8 r).
    EXPECT_NEAR(std::hypot(p[0] - 10, p[1] - 10), 6, 0.25 * 0.25 / (8 * 6)) << p[0] << ", " << p[1];
  }
  // A polygon of chords no longer than the square's diagonal.
  EXPECT_NEAR(around(lines[0]), 2 * kPi * 6, 0.01);
}

TEST(Contour, IsOpenWhereItLeavesTheWindow) {
  const auto lines = contourOf(fieldOf([](const Vec3& p) { return p.x - 1.3 + 0.1 * p.y; }), window(), 0.5);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(std::min(lines[0].front()[1], lines[0].back()[1]), 0);
  EXPECT_EQ(std::max(lines[0].front()[1], lines[0].back()[1]), 20);
  for (const auto& p : lines[0]) EXPECT_NEAR(p[0] - 10 - 1.3 + 0.1 * (p[1] - 10), 0, 1e-12);
}

TEST(Contour, KeepsTheTwoInsidesOfASaddleApart) {
  const Sheet sheet{1, 1, 1, {-1, 1, 1, -1}};
  const auto lines = linesOf(sheet);
  ASSERT_EQ(lines.size(), 2U);
  for (const auto& line : lines) {
    ASSERT_EQ(line.size(), 2U);
    const double side = line[0][0] + line[0][1] - 1;  // each cuts off one inside corner, (0, 0) or (1, 1)
    EXPECT_GT(side * (line[1][0] + line[1][1] - 1), 0);
  }
}

TEST(Contour, IsEmptyWhereNothingCrosses) {
  EXPECT_TRUE(contourOf(fieldOf([](const Vec3&) { return 1.0; }), window(), 0.5).empty());
  EXPECT_TRUE(silhouetteOf({}, window(), 0.5).empty());
}

/// Two tetrahedra's worth of a box's sides would do as well; a box seen along z is its rectangle whatever its height.
mesh::TriangleMesh box(const Vec3& low, const Vec3& high) {
  mesh::TriangleMesh out;
  for (int n = 0; n < 8; ++n) {
    out.vertices.push_back({n & 1 ? high.x : low.x, n & 2 ? high.y : low.y, n & 4 ? high.z : low.z});
  }
  out.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                   {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return out;
}

TEST(Silhouette, OfABoxIsItsRectangleFromEverySide) {
  const mesh::TriangleMesh bone = box({-5.03, -3.07, -1.9}, {4.01, 6.11, 2.2});
  const double step = 0.25;
  const auto from_above = silhouetteOf(bone, window(), step);
  ASSERT_EQ(from_above.size(), 1U);
  double left = 99, right = -99, top = 99, bottom = -99;
  for (const auto& p : from_above[0]) {
    left = std::min(left, p[0] - 10), right = std::max(right, p[0] - 10);
    top = std::min(top, p[1] - 10), bottom = std::max(bottom, p[1] - 10);
  }
  EXPECT_NEAR(left, -5.03, step / 4);
  EXPECT_NEAR(right, 4.01, step / 4);
  EXPECT_NEAR(top, -3.07, step / 4);
  EXPECT_NEAR(bottom, 6.11, step / 4);
  const auto from_front = silhouetteOf(bone, {{-10, 0, 10}, {1, 0, 0}, {0, 0, -1}, 20, 20}, step);
  ASSERT_EQ(from_front.size(), 1U);
  // The corners are cut by at most half a square's diagonal each.
  EXPECT_NEAR(around(from_front[0]), 2 * (9.04 + 4.1), 4 * step);
}

TEST(Silhouette, ShowsAHoleThatOneSeesThrough) {
  mesh::TriangleMesh ring;
  for (const auto& part : {box({-6, -6, 0}, {6, -2, 1}), box({-6, 2, 0}, {6, 6, 1}), box({-6, -3, 3}, {-2, 3, 4}),
                           box({2, -3, -3}, {6, 3, -2})}) {
    const auto first = static_cast<std::uint32_t>(ring.vertices.size());
    ring.vertices.insert(ring.vertices.end(), part.vertices.begin(), part.vertices.end());
    for (const auto& t : part.triangles) ring.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  EXPECT_EQ(silhouetteOf(ring, window(), 0.25).size(), 2U) << "outline and hole";
}

TEST(Silhouette, IsCutOffByTheWindowsEdge) {
  const auto lines = silhouetteOf(box({-30, -3, 0}, {30, 3, 1}), window(), 0.5);
  ASSERT_FALSE(lines.empty());
  for (const auto& line : lines)
    for (const auto& p : line) {
      EXPECT_GE(p[0], 0);
      EXPECT_LE(p[0], 20);
    }
}

}  // namespace
}  // namespace spinaltap::tradeoff
