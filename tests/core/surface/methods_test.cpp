#include "core/surface/methods.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tests/core/surface/ball.h"

namespace spinaltap::surface {
namespace {

/// 5 x 5 pixels in the middle of a slice of 9 x 9, one slice of three; pixels 0.5 x 0.4 mm.
Scan square() {
  Grid g;
  g.dims = {9, 9, 3};
  g.spacing_mm = {0.5, 0.4, 2};
  Scan s{{g, std::vector<std::int16_t>(g.voxels(), 0)}, {g, std::vector<std::uint8_t>(g.voxels(), 0)}};
  for (int j = 2; j < 7; ++j)
    for (int i = 2; i < 7; ++i) s.label.inside[g.index(i, j, 1)] = 1;
  return s;
}

std::map<std::pair<int, int>, double> bySlicePixel(const SignedSamples& samples) {
  std::map<std::pair<int, int>, double> out;
  for (std::size_t n = 0; n < samples.positions.size(); ++n) {
    const Vec3& p = samples.positions[n];
    EXPECT_EQ(p.z, 2);
    const auto [at, fresh] =
        out.emplace(std::pair(static_cast<int>(std::lround(p.x / 0.5)), static_cast<int>(std::lround(p.y / 0.4))),
                    samples.distances_mm[n]);
    EXPECT_TRUE(fresh) << "a pixel counts once";
  }
  return out;
}

TEST(PixelMethod, TakesBoundaryPixelsAndTheirFourNeighbours) {
  const Scan s = square();
  const auto made = sampleSurface(s.ct, s.label, Method::Pixel);
  ASSERT_TRUE(made.has_value());
  const auto at = bySlicePixel(made->samples);
  // By hand: 16 on the rim, 20 outside (five a side, no corners), 12 inside the rim less its own corners' sharing: the
  // 3 x 3 block's outer eight.
  EXPECT_EQ(at.size(), 16U + 20U + 8U);
  EXPECT_EQ(at.at({2, 2}), 0);
  EXPECT_EQ(at.at({4, 6}), 0);
  EXPECT_EQ(at.at({1, 4}), 0.5);
  EXPECT_EQ(at.at({4, 7}), 0.4);
  EXPECT_EQ(at.at({3, 4}), -0.5);
  EXPECT_EQ(at.at({4, 3}), -0.4);
  EXPECT_EQ(at.at({3, 3}), -0.4) << "met along both axes: the nearer";
  EXPECT_EQ(at.count({1, 1}), 0U);
  EXPECT_EQ(at.count({4, 4}), 0U);
}

TEST(NormalMethod, SumsTheVectorsToTheNeighboursOutside) {
  const Scan s = square();
  const auto made = sampleSurface(s.ct, s.label, Method::Normal);
  ASSERT_TRUE(made.has_value());
  ASSERT_EQ(made->points.normals.size(), 16U);
  for (std::size_t n = 0; n < 16; ++n) {
    const int i = static_cast<int>(std::lround(made->points.positions_patient[n].x / 0.5));
    const int j = static_cast<int>(std::lround(made->points.positions_patient[n].y / 0.4));
    Vec3 wanted{i == 2 ? -0.5 : i == 6 ? 0.5 : 0, j == 2 ? -0.4 : j == 6 ? 0.4 : 0, 0};
    EXPECT_LT(norm(made->points.normals[n] - normalized(wanted)), 1e-15);
  }
}

TEST(NormalMethod, AnObliqueGridTurnsTheNormalsWithIt) {
  Scan s = square();
  s.ct.grid.direction = turned();
  s.label.grid = s.ct.grid;
  const auto straight = sampleSurface(square().ct, square().label, Method::Normal);
  const auto oblique = sampleSurface(s.ct, s.label, Method::Normal);
  ASSERT_TRUE(straight.has_value() && oblique.has_value());
  ASSERT_EQ(straight->samples.positions.size(), oblique->samples.positions.size());
  for (std::size_t n = 0; n < straight->samples.positions.size(); ++n) {
    EXPECT_LT(norm(turned() * straight->samples.positions[n] - oblique->samples.positions[n]), 1e-12);
  }
}

TEST(NormalMethod, APlateOnePixelThickHasNoNormals) {
  Scan s = square();
  std::fill(s.label.inside.begin(), s.label.inside.end(), std::uint8_t{0});
  for (int i = 2; i < 7; ++i) s.label.inside[s.label.grid.index(i, 4, 1)] = 1;
  const auto made = sampleSurface(s.ct, s.label, Method::Normal);
  ASSERT_TRUE(made.has_value());
  // Only the two ends have one, before and behind them.
  EXPECT_EQ(made->samples.positions.size(), 5U + 2U + 2U);
}

TEST(Methods, TheLabelsEdgeIsThePixelsOfTheVolumesEdgeToo) {
  Scan s = square();
  std::fill(s.label.inside.begin(), s.label.inside.end(), std::uint8_t{1});
  const auto made = sampleSurface(s.ct, s.label, Method::Pixel);
  ASSERT_TRUE(made.has_value());
  EXPECT_EQ(made->points.normals.size(), 3U * 32U);
}

TEST(Methods, SubvoxelIsFarCloserToTheTruthThanThePixels) {
  const Ball ball;
  const Scan s = scan(gridAround({0, 0, 0}, {0.5, 0.5, 1.0}, 16), ball);
  const auto pixel = sampleSurface(s.ct, s.label, Method::Pixel);
  const auto fine = sampleSurface(s.ct, s.label, Method::Subvoxel);
  ASSERT_TRUE(pixel.has_value() && fine.has_value());
  EXPECT_LT(3 * errorsOf(fine->points, ball).rms, errorsOf(pixel->points, ball).rms);
}

TEST(Methods, HaveNames) {
  for (const Method m : {Method::Pixel, Method::Normal, Method::Subvoxel}) EXPECT_EQ(methodOf(nameOf(m)), m);
  EXPECT_FALSE(methodOf("voxel").has_value());
}

}  // namespace
}  // namespace spinaltap::surface
