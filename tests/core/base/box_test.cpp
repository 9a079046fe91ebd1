#include "core/base/box.h"

#include <gtest/gtest.h>

#include <array>

namespace spinaltap {
namespace {

TEST(Box, IsTheSmallestAroundItsPointsWhereverTheyAre) {
  const std::array<Vec3, 3> points{{{-5, 9, -2}, {-3, 7, -8}, {-4, 8, -1}}};  // all away from the origin
  const Box box = boxAround(points);
  EXPECT_EQ(box.low, (Vec3{-5, 7, -8}));
  EXPECT_EQ(box.high, (Vec3{-3, 9, -1}));
}

TEST(Box, OfOnePointHasNoSize) {
  const std::array<Vec3, 1> point{{{1, -2, 3}}};
  EXPECT_EQ(boxAround(point).low, point[0]);
  EXPECT_EQ(boxAround(point).high, point[0]);
}

TEST(Box, WidensByTheMarginOnEverySide) {
  const Box box = Box{{-1, 2, -3}, {4, 5, 6}}.widened(0.5);
  EXPECT_EQ(box.low, (Vec3{-1.5, 1.5, -3.5}));
  EXPECT_EQ(box.high, (Vec3{4.5, 5.5, 6.5}));
}

}  // namespace
}  // namespace spinaltap
