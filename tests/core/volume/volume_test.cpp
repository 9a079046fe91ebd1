#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/dmath.h"
#include "core/base/random.h"
#include "core/volume/crop.h"
#include "core/volume/grid.h"
#include "core/volume/sample.h"
#include "core/volume/slice.h"

namespace spinaltap::volume {
namespace {

/// Turned about all three axes, anisotropic, a kilometre away.
Grid awkwardGrid() {
  Grid g;
  g.dims = {9, 7, 5};
  g.spacing_mm = {0.352, 0.7, 2.5};
  g.origin_patient = {1e6, -1e6, 1e6};
  const SinCos a = sinCos(0.3), b = sinCos(-0.5);
  g.direction.col_x = {a.cos, a.sin, 0};
  g.direction.col_y = {-a.sin * b.cos, a.cos * b.cos, b.sin};
  g.direction.col_z = cross(g.direction.col_x, g.direction.col_y);
  return g;
}

/// HU that are linear in voxel coordinates, so trilinear sampling must return them exactly but for rounding.
CtVolume linearCt(const Grid& grid) {
  CtVolume ct{grid, {}};
  for (int k = 0; k < grid.dims[2]; ++k)
    for (int j = 0; j < grid.dims[1]; ++j)
      for (int i = 0; i < grid.dims[0]; ++i) ct.hu.push_back(static_cast<std::int16_t>(10 * i - 20 * j + 30 * k + 100));
  return ct;
}

// A coordinate of 1e6 mm has an ulp of 1.2e-10 mm; a dozen roundings over the smallest spacing stay far below this.
constexpr double kFarTolerance_voxels = 1e-8;

TEST(Grid, VoxelCoordinatesSurviveTheWayToThePatientAndBackAKilometreAway) {
  const Grid g = awkwardGrid();
  ASSERT_TRUE(checkGrid(g).has_value());
  Random random(7);
  for (int n = 0; n < 1000; ++n) {
    const Vec3 v{random.uniform(-5, 15), random.uniform(-5, 15), random.uniform(-5, 15)};
    EXPECT_LT(norm(g.toVoxel(g.toPatient(v)) - v), kFarTolerance_voxels) << "seed 7, case " << n;
  }
}

TEST(Grid, ANeighbouringVoxelIsOneSpacingAway) {
  const Grid g = awkwardGrid();
  const Vec3 step = g.toPatient({1, 2, 3}) - g.toPatient({1, 2, 2});
  EXPECT_NEAR(norm(step), 2.5, 1e-9);
  EXPECT_NEAR(dot(step, g.direction.col_z), 2.5, 1e-9);
}

TEST(Grid, RefusesWhatIsNotAGrid) {
  Grid g = awkwardGrid();
  g.dims = {0, 1, 1};
  EXPECT_EQ(checkGrid(g).error().code, ErrorCode::InvalidArgument);
  g.dims = {4096, 4096, 4096};
  EXPECT_EQ(checkGrid(g).error().code, ErrorCode::Limit);
  g = awkwardGrid();
  g.spacing_mm.y = 0;
  EXPECT_EQ(checkGrid(g).error().code, ErrorCode::InvalidArgument);
  g.spacing_mm.y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(checkGrid(g).error().code, ErrorCode::NotFinite);
  g = awkwardGrid();
  g.direction.col_x = g.direction.col_x * 1.01;
  EXPECT_EQ(checkGrid(g).error().code, ErrorCode::InvalidArgument);
  g = awkwardGrid();
  g.direction.col_z = -g.direction.col_z;
  EXPECT_NE(checkGrid(g).error().message.find("left-handed"), std::string::npos);
}

TEST(Sample, IsExactOnLinearDataInAnObliqueStack) {
  const CtVolume ct = linearCt(awkwardGrid());
  Random random(11);
  for (int n = 0; n < 1000; ++n) {
    const Vec3 v{random.uniform(0, 8), random.uniform(0, 6), random.uniform(0, 4)};
    // The largest slope is 30 HU a voxel.
    EXPECT_NEAR(sampleHu(ct, ct.grid.toPatient(v)), 10 * v.x - 20 * v.y + 30 * v.z + 100, 60 * kFarTolerance_voxels)
        << "seed 11, case " << n;
  }
}

TEST(Sample, TakesTheNearestEdgeVoxelOutside) {
  const CtVolume ct = linearCt(awkwardGrid());
  EXPECT_EQ(sampleHuAtVoxel(ct, {-3, 2, 1}), ct.hu[ct.grid.index(0, 2, 1)]);
  EXPECT_EQ(sampleHuAtVoxel(ct, {1e9, -1e9, 1e9}), ct.hu[ct.grid.index(8, 0, 4)]);
  EXPECT_EQ(sampleHuAtVoxel(ct, {8, 6, 4}), ct.hu[ct.grid.index(8, 6, 4)]);
}

TEST(Sample, AVolumeOneVoxelThickCanBeSampled) {
  CtVolume ct;
  ct.grid.dims = {1, 1, 1};
  ct.hu = {321};
  EXPECT_EQ(sampleHu(ct, {0.3, -0.2, 5}), 321);
}

TEST(Crop, KeepsEveryVoxelAtItsPlaceInThePatient) {
  const CtVolume ct = linearCt(awkwardGrid());
  const auto part = cropTo(ct, {2, 1, 1}, {7, 5, 3});
  ASSERT_TRUE(part.has_value());
  EXPECT_EQ(part->grid.dims, (std::array<int, 3>{6, 5, 3}));
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 5; ++j) {
      for (int i = 0; i < 6; ++i) {
        EXPECT_EQ(part->hu[part->grid.index(i, j, k)], ct.hu[ct.grid.index(i + 2, j + 1, k + 1)]);
        const Vec3 here = part->grid.toPatient({1.0 * i, 1.0 * j, 1.0 * k});
        EXPECT_LT(norm(here - ct.grid.toPatient({i + 2.0, j + 1.0, k + 1.0})), 1e-8);
      }
    }
  }
}

TEST(Crop, RefusesABoxThatLeavesTheGridOrIsInsideOut) {
  const CtVolume ct = linearCt(awkwardGrid());
  EXPECT_EQ(cropTo(ct, {0, 0, 0}, {9, 1, 1}).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(cropTo(ct, {-1, 0, 0}, {1, 1, 1}).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(cropTo(ct, {3, 0, 0}, {2, 1, 1}).error().code, ErrorCode::InvalidArgument);
  CtVolume broken = ct;
  broken.hu.pop_back();
  EXPECT_EQ(cropTo(broken, {0, 0, 0}, {1, 1, 1}).error().code, ErrorCode::InvalidArgument);
}

TEST(Crop, BoundsHoldTheLabelAndWideningStopsAtTheGridsEdge) {
  LabelVolume label{awkwardGrid(), std::vector<std::uint8_t>(awkwardGrid().voxels(), 0)};
  EXPECT_EQ(boundsOf(label).error().code, ErrorCode::NotFound);
  label.inside[label.grid.index(3, 4, 2)] = 1;
  label.inside[label.grid.index(6, 1, 3)] = 1;
  const auto box = boundsOf(label);
  ASSERT_TRUE(box.has_value());
  EXPECT_EQ(*box, (VoxelBox{{3, 1, 2}, {6, 4, 3}}));
  // 0.8 mm is 2.3 voxels of 0.352, 1.1 of 0.7 and 0.3 of 2.5: rounded up 3, 2 and 1, then cut.
  EXPECT_EQ(widened(*box, label.grid, 0.8), (VoxelBox{{0, 0, 1}, {8, 6, 4}}));
}

TEST(Slice, ShowsTheVoxelsOfAnAxialStackUnchanged) {
  Grid g;
  g.dims = {9, 7, 5};
  g.origin_patient = {100, 200, -300};
  const CtVolume ct = linearCt(g);
  const auto slice = sliceThrough(ct, PatientPlane::Axial, {104, 203, -298});
  ASSERT_TRUE(slice.has_value());
  ASSERT_EQ(slice->plane.width, 9);
  ASSERT_EQ(slice->plane.height, 7);
  for (int j = 0; j < 7; ++j)
    for (int i = 0; i < 9; ++i) EXPECT_EQ(slice->hu[static_cast<std::size_t>(j * 9 + i)], ct.hu[g.index(i, j, 2)]);
}

TEST(Slice, CoronalAndSagittalHaveTheHeadUp) {
  Grid g;
  g.dims = {9, 7, 5};
  const CtVolume ct = linearCt(g);
  const auto coronal = sliceThrough(ct, PatientPlane::Coronal, {0, 3, 0});
  const auto sagittal = sliceThrough(ct, PatientPlane::Sagittal, {4, 0, 0});
  ASSERT_TRUE(coronal.has_value() && sagittal.has_value());
  EXPECT_EQ(coronal->hu[0], ct.hu[g.index(0, 3, 4)]);
  EXPECT_EQ(coronal->hu.back(), ct.hu[g.index(8, 3, 0)]);
  EXPECT_EQ(sagittal->hu[0], ct.hu[g.index(4, 0, 4)]);
  EXPECT_EQ(sagittal->hu.back(), ct.hu[g.index(4, 6, 0)]);
}

TEST(Slice, InAnyPlaneFollowsTheDataAndIsAirOutside) {
  const CtVolume ct = linearCt(awkwardGrid());
  SlicePlane plane;
  plane.origin_patient = ct.grid.toPatient({4, 3, 2});
  plane.right = normalized(ct.grid.direction.col_x + ct.grid.direction.col_y);
  plane.down = ct.grid.direction.col_z;
  plane.pixel_mm = 0.5;
  plane.width = 40, plane.height = 3;
  const auto slice = sliceAlong(ct, plane);
  ASSERT_TRUE(slice.has_value());
  EXPECT_EQ(slice->hu[0], 140);  // 40 - 60 + 60 + 100
  const Vec3 v = ct.grid.toVoxel(plane.origin_patient + plane.right * 0.5 + plane.down * 0.5);
  EXPECT_NEAR(slice->hu[41], 10 * v.x - 20 * v.y + 30 * v.z + 100, 0.5 + 1e-6);  // whole HU
  EXPECT_EQ(slice->hu[39], kOutsideHu);
}

TEST(Slice, RefusesPlanesThatAreNotPlanes) {
  const CtVolume ct = linearCt(awkwardGrid());
  SlicePlane plane;
  EXPECT_EQ(sliceAlong(ct, plane).error().code, ErrorCode::InvalidArgument);
  plane.width = plane.height = 5000;
  EXPECT_EQ(sliceAlong(ct, plane).error().code, ErrorCode::Limit);
  plane.width = plane.height = 5;
  plane.down = {1, 0, 0};
  EXPECT_EQ(sliceAlong(ct, plane).error().code, ErrorCode::InvalidArgument);
  plane.down = {0, 1, 0};
  plane.pixel_mm = std::numeric_limits<double>::infinity();
  EXPECT_EQ(sliceAlong(ct, plane).error().code, ErrorCode::NotFinite);
}

}  // namespace
}  // namespace spinaltap::volume
