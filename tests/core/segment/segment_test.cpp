#include "core/segment/segment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "core/base/dmath.h"
#include "core/base/random.h"
#include "core/segment/distance.h"
#include "core/segment/flood.h"
#include "core/volume/sample.h"

namespace spinaltap::segment {
namespace {

using volume::CtVolume;
using volume::Grid;

/// A vertebra reduced to what matters here, in mm: a body (hollow box: shell 2 mm of 800 HU, marrow of 90 HU) and
/// behind it a ring around a canal that runs through from feet to head. Soft tissue 40 HU.
bool inBody(const Vec3& p) { return std::abs(p.x) <= 15 && std::abs(p.y) <= 10 && std::abs(p.z) <= 12; }
bool inMarrow(const Vec3& p) { return std::abs(p.x) <= 13 && std::abs(p.y) <= 8 && std::abs(p.z) <= 10; }
bool inCanal(const Vec3& p) { return std::abs(p.x) <= 7 && p.y > 10 && p.y <= 22; }
bool inArch(const Vec3& p) { return std::abs(p.x) <= 11 && p.y > 10 && p.y <= 26 && std::abs(p.z) <= 8 && !inCanal(p); }

CtVolume paint(const Grid& grid, const std::function<double(const Vec3&)>& hu) {
  CtVolume ct{grid, {}};
  for (int k = 0; k < grid.dims[2]; ++k)
    for (int j = 0; j < grid.dims[1]; ++j)
      for (int i = 0; i < grid.dims[0]; ++i)
        ct.hu.push_back(static_cast<std::int16_t>(hu(grid.toPatient({1.0 * i, 1.0 * j, 1.0 * k}))));
  return ct;
}

double vertebraHu(const Vec3& p) {
  if (inMarrow(p)) return 90;
  return inBody(p) || inArch(p) ? 800 : 40;
}

Grid gridAround() {
  Grid g;
  g.dims = {60, 70, 24};
  g.spacing_mm = {0.8, 0.8, 2.0};
  g.origin_patient = {-24, -20, -24};
  return g;
}

std::uint8_t at(const volume::LabelVolume& label, const Vec3& patient) {
  const Vec3 v = label.grid.toVoxel(patient);
  return label.inside[label.grid.index(static_cast<int>(std::lround(v.x)), static_cast<int>(std::lround(v.y)),
                                       static_cast<int>(std::lround(v.z)))];
}

GrowOptions seedAt(const Vec3& seed) {
  GrowOptions o;
  o.seed_patient = seed;
  return o;
}

TEST(GrowFromSeed, FillsTheMarrowAndLeavesTheCanalOpen) {
  const CtVolume ct = paint(gridAround(), vertebraHu);
  const auto label = growFromSeed(ct, seedAt({14, 0, 0}));
  ASSERT_TRUE(label.has_value()) << label.error().message;
  EXPECT_EQ(label->grid, ct.grid);
  for (int k = 0; k < ct.grid.dims[2]; ++k) {
    for (int j = 0; j < ct.grid.dims[1]; ++j) {
      for (int i = 0; i < ct.grid.dims[0]; ++i) {
        const Vec3 p = ct.grid.toPatient({1.0 * i, 1.0 * j, 1.0 * k});
        const bool bone = inBody(p) || inArch(p);
        const bool marked = label->inside[ct.grid.index(i, j, k)] != 0;
        // Closing may round concave corners: only there, within its radius of 1.5 mm, may the two differ.
        if (bone || inCanal(p)) {
          if (bone) {
            EXPECT_TRUE(marked) << p.x << " " << p.y << " " << p.z;
          } else if (std::abs(p.x) < 5.4 && p.y > 11.6 && p.y < 20.4) {
            EXPECT_FALSE(marked) << p.x << " " << p.y << " " << p.z;
          }
        }
      }
    }
  }
}

TEST(GrowFromSeed, BridgesASmallGapInTheShellBeforeFilling) {
  const CtVolume ct = paint(gridAround(), [](const Vec3& p) {
    // The hole of a vein in the front wall: two voxels of 0.8 mm wide, one slice high.
    return std::abs(p.x - 0.4) <= 0.6 && std::abs(p.z) <= 1.2 && p.y < 0 && inBody(p) ? 60.0 : vertebraHu(p);
  });
  GrowOptions o = seedAt({14, 0, 0});
  const auto bridged = growFromSeed(ct, o);
  ASSERT_TRUE(bridged.has_value());
  EXPECT_EQ(at(*bridged, {0, 0, 0}), 1);
  o.closing_mm = 0;
  const auto open = growFromSeed(ct, o);
  ASSERT_TRUE(open.has_value());
  EXPECT_EQ(at(*open, {0, 0, 0}), 0);
}

TEST(GrowFromSeed, StartsFromTheNearestBoneAndNamesTheHuWhereThereIsNone) {
  const CtVolume ct = paint(gridAround(), vertebraHu);
  EXPECT_TRUE(growFromSeed(ct, seedAt({11.5, 0, 0})).has_value());  // marrow, 1.5 mm from the shell
  GrowOptions near = seedAt({0, 0, 0});
  near.seed_reach_mm = 3;
  const auto far = growFromSeed(ct, near);
  ASSERT_FALSE(far.has_value());
  EXPECT_EQ(far.error().code, ErrorCode::NotFound);
  EXPECT_NE(far.error().message.find("90 HU"), std::string::npos) << far.error().message;
  EXPECT_NE(far.error().message.find("150 HU"), std::string::npos) << far.error().message;
}

TEST(GrowFromSeed, PassesOverSpecksOfNoiseInDarkMarrow) {
  const CtVolume ct = paint(gridAround(), [](const Vec3& p) { return norm(p) < 3 ? 400.0 : vertebraHu(p); });
  const auto label = growFromSeed(ct, seedAt({0, 0, 0}));
  ASSERT_TRUE(label.has_value()) << label.error().message;
  EXPECT_EQ(at(*label, {14, 0, 0}), 1);
}

TEST(GrowFromSeed, StopsWhenItLeaks) {
  const CtVolume ct = paint(gridAround(), vertebraHu);
  GrowOptions o = seedAt({14, 0, 0});
  o.threshold_hu = 30;  // soft tissue too
  o.max_volume_mm3 = 40'000;
  const auto leak = growFromSeed(ct, o);
  ASSERT_FALSE(leak.has_value());
  EXPECT_EQ(leak.error().code, ErrorCode::Limit);
  EXPECT_NE(leak.error().message.find("40000"), std::string::npos);
}

TEST(GrowFromSeed, StaysInItsBoxWhereANeighbourTouches) {
  const auto two = [](const Vec3& p) { return std::abs(p.x) <= 3 && p.z > 8 ? 700.0 : vertebraHu(p); };
  const CtVolume ct = paint(gridAround(), two);
  GrowOptions o = seedAt({14, 0, 0});
  EXPECT_EQ(at(*growFromSeed(ct, o), {0, 0, 20}), 1);
  o.half_box_mm.z = 13;
  const auto boxed = growFromSeed(ct, o);
  ASSERT_TRUE(boxed.has_value());
  EXPECT_EQ(at(*boxed, {0, 0, 20}), 0);
  EXPECT_EQ(at(*boxed, {0, 24, 0}), 1);
  o.half_box_mm.y = 14;
  EXPECT_EQ(at(*growFromSeed(ct, o), {0, 24, 0}), 0);
  o.box_offset_mm.y = 12;
  EXPECT_EQ(at(*growFromSeed(ct, o), {0, 24, 0}), 1);
}

TEST(GrowFromSeed, CutsNarrowBridgesToANeighbour) {
  const auto bridged = [](const Vec3& p) {
    const bool neighbour = p.z > 16 && std::abs(p.x) <= 15 && std::abs(p.y) <= 10;
    const bool bridge = std::abs(p.x - 10) <= 1.6 && std::abs(p.y) <= 1.6 && p.z > 0;
    return neighbour || bridge ? 700.0 : vertebraHu(p);
  };
  Grid g = gridAround();
  g.spacing_mm.z = 1.0, g.dims[2] = 48;
  const CtVolume ct = paint(g, bridged);
  GrowOptions o = seedAt({14, 0, 0});
  EXPECT_EQ(at(*growFromSeed(ct, o), {0, 0, 20}), 1);
  o.neck_mm = 1.9;
  const auto cut = growFromSeed(ct, o);
  ASSERT_TRUE(cut.has_value()) << cut.error().message;
  EXPECT_EQ(at(*cut, {0, 0, 20}), 0);
  EXPECT_EQ(at(*cut, {0, 0, 0}), 1);
  EXPECT_EQ(at(*cut, {9, 24, 0}), 1);  // the arch is 4 mm thick and stays
}

TEST(GrowFromSeed, ABoneCutOffByTheVolumesEdgeIsFilledToo) {
  Grid g = gridAround();
  g.dims[2] = 12;  // ends inside the body
  const CtVolume ct = paint(g, vertebraHu);
  const auto label = growFromSeed(ct, seedAt({14, 0, -6}));
  ASSERT_TRUE(label.has_value());
  // The marrow lies open at the cut, so it may stay empty; what must not happen is a canal that is closed.
  EXPECT_EQ(at(*label, {0, 16, -4}), 0);
  EXPECT_EQ(at(*label, {14, 0, -4}), 1);
}

TEST(GrowFromSeed, WorksInATurnedStackFarAway) {
  Grid g = gridAround();
  const SinCos a = sinCos(0.4);
  g.direction.col_x = {a.cos, a.sin, 0};
  g.direction.col_y = {-a.sin, a.cos, 0};
  const Vec3 far{1e6, -1e6, 1e6};
  g.origin_patient = far + g.direction * Vec3{-24, -20, -24};
  const CtVolume ct = paint(g, [&](const Vec3& p) { return vertebraHu(transposeTimes(g.direction, p - far)); });
  GrowOptions o = seedAt(far + g.direction * Vec3{14, 0, 0});
  o.half_box_mm = {60, 60, 13};
  const auto label = growFromSeed(ct, o);
  ASSERT_TRUE(label.has_value()) << label.error().message;
  EXPECT_EQ(at(*label, far), 1);
  EXPECT_EQ(at(*label, far + g.direction * Vec3{0, 16, 0}), 0);
}

TEST(GrowFromSeed, RefusesOptionsOutOfRange) {
  const CtVolume ct = paint(gridAround(), vertebraHu);
  EXPECT_EQ(growFromSeed(ct, seedAt({500, 0, 0})).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(growFromSeed(ct, seedAt({std::numeric_limits<double>::quiet_NaN(), 0, 0})).error().code,
            ErrorCode::NotFinite);
  GrowOptions o = seedAt({14, 0, 0});
  o.half_box_mm.x = 0;
  EXPECT_EQ(growFromSeed(ct, o).error().code, ErrorCode::InvalidArgument);
  o = seedAt({14, 0, 0});
  o.closing_mm = -1;
  EXPECT_EQ(growFromSeed(ct, o).error().code, ErrorCode::InvalidArgument);
  CtVolume broken = ct;
  broken.hu.pop_back();
  EXPECT_EQ(growFromSeed(broken, seedAt({14, 0, 0})).error().code, ErrorCode::InvalidArgument);
}

TEST(KeepLabel, TakesOneValueAndListsWhatIsThereWhenItIsNot) {
  Grid g;
  g.dims = {2, 2, 1};
  const std::vector<std::int32_t> values{0, 20, 22, 22};
  const auto kept = keepLabel(g, values, 22);
  ASSERT_TRUE(kept.has_value());
  EXPECT_EQ(kept->inside, (std::vector<std::uint8_t>{0, 0, 1, 1}));
  const auto missing = keepLabel(g, values, 23);
  ASSERT_FALSE(missing.has_value());
  EXPECT_EQ(missing.error().message, "no voxel has label 23; present: 0, 20, 22");
  EXPECT_EQ(keepLabel(g, std::span(values).first(3), 22).error().code, ErrorCode::InvalidArgument);
}

TEST(LargestIsland, DropsTheSpecks) {
  volume::LabelVolume label;
  label.grid.dims = {6, 1, 1};
  label.inside = {1, 0, 1, 1, 0, 1};
  EXPECT_EQ(largestIsland(label)->inside, (std::vector<std::uint8_t>{0, 0, 1, 1, 0, 0}));
  label.inside.assign(6, 0);
  EXPECT_EQ(largestIsland(label).error().code, ErrorCode::NotFound);
}

/// The slow twin of the distance transform: every pair of voxels.
TEST(SquaredDistances, EqualsTheBruteForceDistanceInAnisotropicBlocks) {
  Random random(21);
  for (int round = 0; round < 20; ++round) {
    Mask m;
    m.dims = {1 + static_cast<int>(random.below(9)), 1 + static_cast<int>(random.below(9)),
              1 + static_cast<int>(random.below(9))};
    m.spacing_mm = {random.uniform(0.2, 3), random.uniform(0.2, 3), random.uniform(0.2, 3)};
    const int count = m.dims[0] * m.dims[1] * m.dims[2];
    for (int v = 0; v < count; ++v) m.set.push_back(random.unit() < 0.05 ? 1 : 0);
    const auto place = [&](int v) {
      return Vec3{v % m.dims[0] * m.spacing_mm.x, v / m.dims[0] % m.dims[1] * m.spacing_mm.y,
                  v / m.dims[0] / m.dims[1] * m.spacing_mm.z};
    };
    const std::vector<float> fast = squaredDistances(m, 1);
    for (int v = 0; v < count; ++v) {
      double slow = 1e30;
      for (int w = 0; w < count; ++w) {
        const Vec3 d = place(v) - place(w);
        if (m.set[static_cast<std::size_t>(w)] != 0) slow = std::min(slow, dot(d, d));
      }
      // Stored as float: 24 bits, rounded once a pass.
      EXPECT_NEAR(fast[static_cast<std::size_t>(v)], slow, 4e-7 * slow) << "seed 21, round " << round;
    }
  }
}

TEST(FillHoles, FillsWhatIsEnclosedAndLeavesATunnel) {
  Mask m{{5, 5, 5}, {1, 1, 1}, std::vector<std::uint8_t>(125, 0)};
  for (int k = 1; k < 4; ++k)
    for (int j = 1; j < 4; ++j)
      for (int i = 1; i < 4; ++i) m.set[m.index(i, j, k)] = 1;
  m.set[m.index(2, 2, 2)] = 0;
  Mask tunnel = m;
  tunnel.set[m.index(2, 2, 1)] = tunnel.set[m.index(2, 2, 3)] = 0;
  fillHoles(m);
  fillHoles(tunnel);
  EXPECT_EQ(m.set[m.index(2, 2, 2)], 1);
  EXPECT_EQ(tunnel.set[m.index(2, 2, 2)], 0);
}

}  // namespace
}  // namespace spinaltap::segment
