// The report's findings and ours on a small phantom: 1.4 x 1.4 x 2 mm voxels. Accuracy at full size is
// held in tests/server/reconstruct.
#include "core/tradeoff/surface_tradeoff.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace spinaltap::tradeoff {
namespace {

using surface::Method;

const Scene& scene() {
  static const Scene made = [] {
    auto s = phantomScene({}, phantom::CtOptions::coarser(4));
    EXPECT_TRUE(s.has_value());
    return std::move(*s);
  }();
  return made;
}

RunOptions quick() {
  RunOptions o;
  o.sample_spacing_mm = 2, o.cell_mm = 2, o.points = 1000, o.timed_points = 0, o.field_tolerance_mm = 0;
  return o;
}

Measured measured(const Scene& of, const Setting& setting) {
  const auto run = runSetting(of, setting, quick());
  EXPECT_TRUE(run.has_value());
  EXPECT_EQ(run->measured.fault, "");
  return run->measured;
}

/// On the phantom, once for all tests that ask.
const Measured& known(Method method, double smoothing) {
  static std::map<std::pair<Method, double>, Measured> all;
  const auto [at, fresh] = all.try_emplace({method, smoothing});
  if (fresh) at->second = measured(scene(), {method, 0.01, smoothing, 0});
  return at->second;
}

TEST(SurfaceTradeoff, PixelsWithoutSmoothingAreRough) {
  const Measured& pixel = known(Method::Pixel, 0);
  const Measured& normal = known(Method::Normal, 0);
  const Measured& ours = known(Method::Subvoxel, rbf::kAutoSmoothing);
  EXPECT_GT(pixel.roughness_mm, 1.5 * ours.roughness_mm);
  EXPECT_GT(normal.roughness_mm, 1.5 * ours.roughness_mm);
  // Pixels are known to half a pixel, 0.7 mm; the CT's edge to far less.
  EXPECT_GT(pixel.surface.rms_mm, 2 * ours.surface.rms_mm);
  EXPECT_GT(normal.surface.rms_mm, 2 * ours.surface.rms_mm);
  EXPECT_LT(ours.surface.rms_mm, 1.4 / 3) << "a third of a pixel";
}

TEST(SurfaceTradeoff, SmoothingTakesTheRoughnessAndTheTruth) {
  const Measured& none = known(Method::Pixel, 0);
  const Measured& some = known(Method::Pixel, 30);
  const Measured& heavy = known(Method::Pixel, kSwellingSmoothing_mm);
  EXPECT_LT(some.roughness_mm, none.roughness_mm);
  EXPECT_LT(heavy.roughness_mm, some.roughness_mm);
  EXPECT_GT(heavy.surface.rms_mm, none.surface.rms_mm);
  EXPECT_GT(heavy.volume_change_percent, none.volume_change_percent) << "it swells";
  EXPECT_GT(heavy.surface.p99_mm, none.surface.p99_mm + 1) << "by millimetres";
}

TEST(SurfaceTradeoff, ReductionLeavesTheSurfaceWhereItWas) {
  const Measured& all = known(Method::Subvoxel, rbf::kAutoSmoothing);
  const Measured fewer = measured(scene(), {Method::Subvoxel, 0.01, rbf::kAutoSmoothing, 0.3});
  EXPECT_LT(fewer.centres, all.centres / 2);
  EXPECT_EQ(fewer.samples, all.samples);
  // Every sample's value moves by at most 0.3 mm, most by far less.
  EXPECT_NEAR(fewer.surface.rms_mm, all.surface.rms_mm, 0.1);
  EXPECT_NEAR(fewer.missed.rms_mm, all.missed.rms_mm, 0.1);
}

TEST(SurfaceTradeoff, ACaseKeepsEveryFifthPointOfTheCtFromEveryMethodsFit) {
  const auto real = caseScene(scene().ct, scene().label);
  ASSERT_TRUE(real.has_value());
  surface::BoundaryOptions boundary;
  boundary.spacing_mm = quick().sample_spacing_mm;
  const auto points = surface::findBoundary(scene().ct, scene().label, boundary);
  ASSERT_TRUE(points.has_value());
  std::size_t kept = 0;
  for (std::size_t i = 4; i < points->placed.size(); i += 5) kept += points->placed[i] == surface::Placed::ByCt ? 1 : 0;
  const Measured ours = measured(*real, {Method::Subvoxel, 0.01, rbf::kAutoSmoothing, 0});
  const Measured pixel = measured(*real, {Method::Pixel, 0.01, 0, 0});
  EXPECT_EQ(ours.surface.count, kept);
  EXPECT_EQ(pixel.surface.count, kept);
  EXPECT_LT(ours.samples, 3 * (points->placed.size() - kept) + 1);
  EXPECT_LT(ours.surface.rms_mm, 2.0 / 3) << "a third of the longest voxel side";
  EXPECT_LT(2 * ours.surface.rms_mm, pixel.surface.rms_mm);
  EXPECT_EQ(ours.sides.asked, 0U) << "nobody knows";
  EXPECT_EQ(ours.missed.count, 0U);
  // Of points that were fitted, the distance would be the residual: held-out ones must be farther.
  EXPECT_GT(ours.surface.rms_mm, 0.01);
}

TEST(SurfaceTradeoff, WhatFailsIsARowThatSaysWhy) {
  // Smoothed to a plane: a surface that leaves the box.
  const auto run = runSetting(scene(), {Method::Normal, 0.01, 1e9, 0}, quick());
  ASSERT_TRUE(run.has_value());
  EXPECT_NE(run->measured.fault, "");
  EXPECT_TRUE(run->mesh.vertices.empty());
  EXPECT_EQ(run->measured.triangles, 0U);
}

TEST(SurfaceTradeoff, TimeIsTheCallersAndProgressOnlyGrows) {
  RunOptions options = quick();
  options.timed_points = 1000;
  int asked = 0;
  options.clock = [&] { return 1.0 * asked++; };
  double last = 0;
  const auto run = runSetting(scene(), {Method::Pixel, 0.1, 0, 0}, options, [&](double part) {
    EXPECT_GE(part, last);
    EXPECT_LE(part, 1);
    last = part;
  });
  ASSERT_TRUE(run.has_value());
  EXPECT_EQ(run->measured.sample_s, 1);
  EXPECT_EQ(run->measured.fit_s, 1);
  EXPECT_EQ(run->measured.mesh_s, 1);
  EXPECT_EQ(run->measured.points_per_s, 1000);
  EXPECT_GT(last, 0.5);
}

TEST(SurfaceTradeoff, ASceneThatIsOfNoUseIsAnError) {
  volume::LabelVolume empty = scene().label;
  std::fill(empty.inside.begin(), empty.inside.end(), std::uint8_t{0});
  EXPECT_EQ(caseScene(scene().ct, empty).error().code, ErrorCode::NotFound);
  RunOptions options = quick();
  options.sample_spacing_mm = 0;
  EXPECT_EQ(runSetting(scene(), {}, options).error().code, ErrorCode::InvalidArgument);
}

TEST(SurfaceTradeoff, TheUsualSettingsHoldTheReportsThreeForEveryMethod) {
  const auto settings = usualSettings();
  for (const Method method : {Method::Pixel, Method::Normal, Method::Subvoxel}) {
    for (const double smoothing : {0.0, 0.5, 30.0}) {
      EXPECT_EQ(std::count_if(settings.begin(), settings.end(),
                              [&](const Setting& s) {
                                return s.method == method && s.smoothing == smoothing && s.reduce_mm == 0;
                              }),
                1);
    }
  }
}

}  // namespace
}  // namespace spinaltap::tradeoff
