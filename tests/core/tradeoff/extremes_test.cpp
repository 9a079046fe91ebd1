// From odd scans to a closed surface: the whole chain on a ball of bone.
#include <gtest/gtest.h>

#include <cmath>

#include "core/tradeoff/surface_tradeoff.h"
#include "tests/core/mesh/mesh_check.h"
#include "tests/core/surface/ball.h"

namespace spinaltap::tradeoff {
namespace {

using surface::Ball;
using surface::gridAround;
using surface::Method;

Run reconstructed(const volume::Grid& grid, const Ball& ball, Method method = Method::Subvoxel) {
  const auto s = surface::scan(grid, ball);
  const auto scene = caseScene(s.ct, s.label);
  EXPECT_TRUE(scene.has_value());
  RunOptions options;
  options.sample_spacing_mm = 1.5, options.cell_mm = 1, options.timed_points = 0, options.field_tolerance_mm = 0;
  auto run = runSetting(*scene, {method, 0.01, rbf::kAutoSmoothing, 0.05}, options);
  EXPECT_TRUE(run.has_value());
  EXPECT_EQ(run->measured.fault, "");
  const mesh::MeshCheck c = mesh::check(run->mesh);
  EXPECT_EQ(c.open_edges, 0U);
  EXPECT_EQ(c.pinched_vertices, 0U);
  EXPECT_EQ(c.euler, 2) << "one piece without a hole";
  return std::move(*run);
}

double ballVolume(double radius) { return 4.0 / 3 * kPi * std::pow(radius, 3); }

TEST(Extremes, ASingleSliceIsAClosedPlate) {
  const Ball ball;
  auto grid = gridAround({0, 0, 0}, {0.5, 0.5, 3}, 15);
  grid.dims[2] = 1, grid.origin_patient.z = 0;
  const auto run = reconstructed(grid, ball);
  // A disc as thick as the slice; its rim is rounded by up to half the thickness, 2 pi R (1 - pi / 4) (h / 2)^2 * 2.
  // The rim is placed within 0.3 mm, 5 % of the disc, and between samples 1.5 mm apart a face may rise by a twentieth
  // of that.
  const double disc = kPi * 144 * 3, rim = 4 * kPi * 12 * (1 - kPi / 4) * 1.5 * 1.5;
  EXPECT_LT(run.measured.volume_mm3, 1.10 * disc);
  EXPECT_GT(run.measured.volume_mm3, disc - rim);
}

TEST(Extremes, SlicesOfFiveMillimetresWithPixelsOfAFifthGiveOneBall) {
  const Ball ball;
  const auto run = reconstructed(gridAround({0, 0, 0}, {0.2, 0.2, 5}, 20), ball);
  // Five slices cut it. A third of a slice, 1.7 mm, all over would be 40 % of the volume; trapezoids between the
  // sections lose h^2 / (8 R) = 0.26 mm, 6.5 %, and the caps up to as much again.
  EXPECT_NEAR(run.measured.volume_mm3 / ballVolume(12), 1, 0.13);
  double squares = 0;
  for (const Vec3& v : run.mesh.vertices) squares += std::pow(norm(v) - 12, 2);
  EXPECT_LT(std::sqrt(squares / static_cast<double>(run.mesh.vertices.size())), 5.0 / 3);
}

TEST(Extremes, AVolumeThatEndsInBoneGivesABallWithAFlatFace) {
  const Ball ball;
  const auto run = reconstructed(gridAround({0, 0, 10}, {0.5, 0.5, 0.5}, 15), ball);
  // Cut at z = -5.25, the first slice's outer face: the cap below, of height h = 6.75, is not there.
  const double h = 12 - 5.25, cap = kPi * h * h * (3 * 12 - h) / 3;
  EXPECT_NEAR(run.measured.volume_mm3 / (ballVolume(12) - cap), 1, 0.03) << "an edge rounded by the samples' spacing";
}

TEST(Extremes, AnOriginAHundredKilometresAwayGivesTheSameBall) {
  Ball near, far;
  far.middle = {1e8, -1e8, 1e8};
  const auto here = reconstructed(gridAround(near.middle, {0.5, 0.5, 1}, 15), near);
  const auto there = reconstructed(gridAround(far.middle, {0.5, 0.5, 1}, 15), far);
  // Positions are rounded to 1.5e-8 mm; where a lattice node or a centre changes sides, the mesh may differ by a chord.
  EXPECT_NEAR(there.measured.volume_mm3 / here.measured.volume_mm3, 1, 1e-3);
}

TEST(Extremes, TheReportsMethodsSurviveASingleSliceToo) {
  auto grid = gridAround({0, 0, 0}, {0.5, 0.5, 3}, 15);
  const auto s = surface::scan(grid, Ball{});
  Scene one{s.ct, s.label, std::nullopt, 1};
  for (std::size_t n = 0; n < one.label.inside.size(); ++n) {
    if (n / (61 * 61) != 5) one.label.inside[n] = 0;
  }
  RunOptions options;
  options.timed_points = 0, options.cell_mm = 1, options.sample_spacing_mm = 1.5;
  for (const Method method : {Method::Pixel, Method::Normal}) {
    // All samples in one plane: nothing tells where the bone ends along z, and the fit says so.
    const auto run = runSetting(one, {method, 0.01, 0, 0}, options);
    ASSERT_TRUE(run.has_value());
    EXPECT_NE(run->measured.fault.find("plane"), std::string::npos) << run->measured.fault;
  }
}

}  // namespace
}  // namespace spinaltap::tradeoff
