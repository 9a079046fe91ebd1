#include "core/segment/isolate.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <limits>
#include <string>

#include "core/base/dmath.h"
#include "core/base/parallel.h"
#include "core/segment/distance.h"
#include "core/segment/flood.h"
#include "tests/core/segment/scenes.h"

namespace spinaltap::segment {
namespace {

using scenes::Column;
using scenes::columnOf;
using scenes::dice;
using scenes::gridOf;
using volume::CtVolume;
using volume::Grid;
using volume::LabelVolume;

constexpr Vec3 kSpacing{1.5, 1.5, 1.5};

/// Three vertebrae whose facets touch; made once.
const Column& threeInAColumn() {
  static const Column column = columnOf({.grid = gridOf(kSpacing, 120)});
  return column;
}

Result<Isolated> isolated(const CtVolume& ct, const Vec3& seed) {
  IsolateOptions o;
  o.seed_patient = seed;
  return isolate(ct, o);
}

/// The middle one of the three, isolated once.
const Result<Isolated>& middleOfThree() {
  static const Result<Isolated> found = isolated(threeInAColumn().ct, threeInAColumn().middles[1]);
  return found;
}

/// One vertebra in a small stack, where neighbours do not matter.
const Column& oneAlone() {
  static const Column column = columnOf({.vertebrae = 1, .grid = gridOf({2, 2, 2}, 60)});
  return column;
}

const Result<Isolated>& theOneAlone() {
  static const Result<Isolated> found = isolated(oneAlone().ct, oneAlone().middles[0]);
  return found;
}

/// Voxels 1.5 mm wide: moving the whole surface of the phantom (12,000 mm^2 round 75,000 mm^3) by a fifth of a voxel
/// changes the volume by 5 %, the Dice by half of that; where facets touch without a joint space their halves of 2 mm
/// (2 x 4 facets of 200 mm^2) are a matter of taste: another 2 %.
constexpr double kLeastDice = 0.93;

TEST(Isolate, TakesTheMiddleOneOfThreeTouchingVertebraeOutOfTheColumnFromOneClick) {
  const Column& column = threeInAColumn();
  const auto& found = middleOfThree();
  ASSERT_TRUE(found.has_value()) << found.error().message;
  const double overlap = dice(found->label, column.truth[1]);
  std::printf("  Dice %.4f, threshold %.0f HU\n", overlap, found->threshold_hu);
  EXPECT_GT(overlap, kLeastDice);
  EXPECT_LT(norm(found->body_middle_patient - column.middles[1]), 4);
  EXPECT_EQ(found->neighbours.size(), 2U);
  // and what it took of the other two is less than a facet's half: they are parted at the joints
  for (const std::size_t other : {std::size_t{0}, std::size_t{2}})
    EXPECT_LT(dice(found->label, column.truth[other]), 0.02);
}

TEST(Isolate, NamesItsNeighboursWhereTheyAre) {
  const Column& column = threeInAColumn();
  const auto& found = middleOfThree();
  ASSERT_TRUE(found.has_value() && found->neighbours.size() == 2);
  EXPECT_TRUE(found->neighbours[0].above);
  EXPECT_FALSE(found->neighbours[1].above);
  EXPECT_LT(norm(found->neighbours[0].body_middle_patient - column.middles[0]), 4);
  EXPECT_LT(norm(found->neighbours[1].body_middle_patient - column.middles[2]), 4);
}

TEST(Isolate, AClickSomeMillimetresOffTheMiddleOfTheLowestGivesNearlyTheSame) {
  const Column& column = threeInAColumn();
  Random random(5);
  const Vec3 off{random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-4, 4)};
  const auto found = isolated(column.ct, column.middles[2] + off);
  ASSERT_TRUE(found.has_value()) << "seed 5: " << found.error().message;
  EXPECT_GT(dice(found->label, column.truth[2]), kLeastDice) << "seed 5";
  EXPECT_LT(norm(found->body_middle_patient - column.middles[2]), 4) << "seed 5";
  ASSERT_EQ(found->neighbours.size(), 1U);
  EXPECT_TRUE(found->neighbours[0].above);
}

TEST(Isolate, FillsMarrowAsDarkAsTheTissueRoundTheBone) {
  const Column column = columnOf({.vertebrae = 1, .osteoporotic = true, .grid = gridOf({1.2, 1.2, 1.2}, 66)});
  const auto found = isolated(column.ct, column.middles[0]);
  ASSERT_TRUE(found.has_value()) << found.error().message;
  EXPECT_TRUE(found->neighbours.empty());
  // a shell of 0.5 mm in voxels twice as wide: the edge is there, its place less sure
  EXPECT_GT(dice(found->label, column.truth[0]), 0.9);
}

/// 6-connected parts of what the label leaves, padded by one layer: 1 when nothing is enclosed.
std::size_t outsideParts(const LabelVolume& label) {
  const auto& d = label.grid.dims;
  Mask outside{{d[0] + 2, d[1] + 2, d[2] + 2}, {1, 1, 1}, {}};
  outside.set.assign(
      static_cast<std::size_t>(d[0] + 2) * static_cast<std::size_t>(d[1] + 2) * static_cast<std::size_t>(d[2] + 2), 1);
  for (int k = 0; k < d[2]; ++k)
    for (int j = 0; j < d[1]; ++j)
      for (int i = 0; i < d[0]; ++i) {
        if (label.inside[label.grid.index(i, j, k)] != 0) outside.set[outside.index(i + 1, j + 1, k + 1)] = 0;
      }
  std::size_t parts = 0;
  for (std::size_t v = 0; v < outside.set.size(); ++v) {
    if (outside.set[v] == 0) continue;
    std::ignore = takeConnected(outside, v, outside.set.size());
    ++parts;
  }
  return parts;
}

TEST(Isolate, LeavesOneIslandWithoutHolesAndWithTheCanalOpen) {
  const auto& found = middleOfThree();
  ASSERT_TRUE(found.has_value());
  Mask inside{found->label.grid.dims, kSpacing, found->label.inside};
  const auto total = static_cast<std::size_t>(std::count(inside.set.begin(), inside.set.end(), 1));
  const auto first = static_cast<std::size_t>(std::find(inside.set.begin(), inside.set.end(), 1) - inside.set.begin());
  EXPECT_EQ(takeConnected(inside, first, inside.set.size()).size(), total) << "one island";
  EXPECT_EQ(outsideParts(found->label), 1U) << "nothing is enclosed";
  // Down the middle of the canal, as far as the vertebra reaches and beyond, no voxel is taken.
  const auto one = phantom::Phantom::make({});
  for (double z = -25; z <= 25; z += 0.5) {
    const Vec3 p = one.frame().toPatient({0, 25, z});
    const Vec3 v = found->label.grid.toVoxel(p);
    EXPECT_EQ(
        found->label
            .inside[found->label.grid.index(static_cast<int>(std::lround(v.x)), static_cast<int>(std::lround(v.y)),
                                            static_cast<int>(std::lround(v.z)))],
        0)
        << z;
  }
}

bool touches(const LabelVolume& label, const Vec3& place_patient) {
  const Vec3 v = label.grid.toVoxel(place_patient);
  const int i = static_cast<int>(std::lround(v.x)), j = static_cast<int>(std::lround(v.y)),
            k = static_cast<int>(std::lround(v.z));
  return label.grid.contains(i, j, k) && label.inside[label.grid.index(i, j, k)] != 0;
}

/// Whether bone of any of the three lies within a voxel of a place.
bool isNearBone(const Column& column, const Vec3& p) {
  for (const LabelVolume& truth : column.truth)
    for (const double x : {-1.5, 0.0, 1.5})
      for (const double y : {-1.5, 0.0, 1.5})
        for (const double z : {-1.5, 0.0, 1.5})
          if (touches(truth, p + Vec3{x, y, z})) return true;
  return false;
}

/// Nerve roots leave the canal to both sides below the pedicles. Every straight way out that passes no bone nearer than
/// a voxel is walked from the canal to 30 mm beside it.
TEST(Isolate, LeavesTheForaminaOpenOnBothSides) {
  const Column& column = threeInAColumn();
  const auto& found = middleOfThree();
  ASSERT_TRUE(found.has_value());
  const auto one = phantom::Phantom::make({});
  for (const double side : {-1.0, 1.0}) {
    int ways = 0, closed = 0;
    for (double y = 16; y <= 30; y += 1) {
      for (double z = -20; z <= 0; z += 1) {
        bool free = true, taken = false;
        for (double x = 0; x <= 30 && free; x += 0.75) {
          const Vec3 p = one.frame().toPatient({side * x, y, z});
          free = !isNearBone(column, p);
          taken = taken || touches(found->label, p);
        }
        ways += free ? 1 : 0, closed += free && taken ? 1 : 0;
      }
    }
    EXPECT_GT(ways, 10) << "the scene has a foramen on side " << side;
    EXPECT_EQ(closed, 0) << "of " << ways << " ways out on side " << side;
  }
}

TEST(Isolate, ReturnsWhatWasScannedOfAVertebraThatTheScanCutsOff) {
  const Column& column = threeInAColumn();
  const auto cut = [&](int low_k, int high_k) {
    CtVolume ct{column.ct.grid, {}};
    LabelVolume truth{column.ct.grid, {}};
    ct.grid.dims[2] = truth.grid.dims[2] = high_k - low_k + 1;
    ct.grid.origin_patient = truth.grid.origin_patient = column.ct.grid.toPatient({0, 0, 1.0 * low_k});
    const auto from = static_cast<std::ptrdiff_t>(column.ct.grid.index(0, 0, low_k)),
               to = static_cast<std::ptrdiff_t>(column.ct.grid.index(0, 0, high_k) + column.ct.grid.index(0, 0, 1));
    ct.hu.assign(column.ct.hu.begin() + from, column.ct.hu.begin() + to);
    truth.inside.assign(column.truth[1].inside.begin() + from, column.truth[1].inside.begin() + to);
    return std::pair{ct, truth};
  };
  const double middle = column.ct.grid.toVoxel(column.middles[1]).z;
  // Above the body's lower third; then below its upper third: one plate and a part of the arch are left.
  const auto whole = static_cast<int>(column.ct.grid.dims[2]) - 1;
  for (const auto& [low, high] : {std::pair{static_cast<int>(middle) - 5, whole}, {0, static_cast<int>(middle) + 5}}) {
    const auto [ct, truth] = cut(low, high);
    const auto found = isolated(ct, column.middles[1]);
    ASSERT_TRUE(found.has_value()) << found.error().message;
    EXPECT_GT(dice(found->label, truth), 0.85) << low << " .. " << high;
  }
}

TEST(Isolate, TheSameScanOnATurnedGridGivesTheSameBone) {
  const Column& column = threeInAColumn();
  Grid turned = column.ct.grid;
  const SinCos a = sinCos(0.3);
  turned.direction.col_x = {a.cos, a.sin * a.cos, a.sin * a.sin};  // about two axes
  turned.direction.col_y = {-a.sin, a.cos * a.cos, a.cos * a.sin};
  turned.direction.col_z = {0, -a.sin, a.cos};
  const Vec3 half{0.5 * (turned.dims[0] - 1), 0.5 * (turned.dims[1] - 1), 0.5 * (turned.dims[2] - 1)};
  turned.origin_patient += column.ct.grid.toPatient(half) - turned.toPatient(half);
  const Column oblique = columnOf({.grid = turned});
  const auto found = isolated(oblique.ct, oblique.middles[1]);
  ASSERT_TRUE(found.has_value()) << found.error().message;
  EXPECT_GT(dice(found->label, oblique.truth[1]), kLeastDice);
  // The straight scan's result read at the turned one's voxels. Each grid rounds the surface to its voxels, by a
  // quarter of one (0.375 mm) in the mean: 2 x 0.375 mm x 12,000 mm^2 over twice 75,000 mm^3.
  constexpr double kLeastAgreement = 0.94;
  const auto& straight = middleOfThree();
  ASSERT_TRUE(straight.has_value());
  LabelVolume read{turned, std::vector<std::uint8_t>(turned.voxels(), 0)};
  for (int k = 0; k < turned.dims[2]; ++k)
    for (int j = 0; j < turned.dims[1]; ++j)
      for (int i = 0; i < turned.dims[0]; ++i)
        read.inside[turned.index(i, j, k)] =
            touches(straight->label, turned.toPatient({1.0 * i, 1.0 * j, 1.0 * k})) ? 1 : 0;
  const double agreement = dice(found->label, read);
  std::printf("  turned against straight: Dice %.4f\n", agreement);
  EXPECT_GT(agreement, kLeastAgreement);
}

TEST(Isolate, AFarOriginChangesNoVoxel) {
  const Column& column = oneAlone();
  const auto& near = theOneAlone();
  CtVolume moved = column.ct;
  const Vec3 far{1e8, -1e8, 1e8};
  moved.grid.origin_patient += far;
  const auto there = isolated(moved, column.middles[0] + far);
  ASSERT_TRUE(near.has_value() && there.has_value());
  // Doubles are 1.5e-8 mm apart there, so a place may be sampled that far from where it was: no more than voxels that
  // lie on the very edge may differ.
  EXPECT_GT(dice(near->label, there->label), 0.9999);
}

/// The same values on pixels `factor` times narrower.
std::pair<CtVolume, LabelVolume> splitPixels(const CtVolume& ct, const LabelVolume& truth, int factor) {
  Grid grid = ct.grid;
  grid.dims[0] *= factor, grid.dims[1] *= factor;
  grid.spacing_mm.x /= factor, grid.spacing_mm.y /= factor;
  const double shift = 0.5 * (1.0 / factor - 1);
  grid.origin_patient = ct.grid.toPatient({shift, shift, 0});
  std::pair<CtVolume, LabelVolume> fine{{grid, {}}, {grid, {}}};
  for (int k = 0; k < grid.dims[2]; ++k)
    for (int j = 0; j < grid.dims[1]; ++j)
      for (int i = 0; i < grid.dims[0]; ++i) {
        const std::size_t v = ct.grid.index(i / factor, j / factor, k);
        fine.first.hu.push_back(ct.hu[v]);
        fine.second.inside.push_back(truth.inside[v]);
      }
  return fine;
}

TEST(Isolate, SlicesOf5MillimetresWithPixelsOf02StillGiveAVertebra) {
  const Column column = columnOf({.vertebrae = 1, .grid = gridOf({0.8, 0.8, 5}, 66)});
  const auto [ct, truth] = splitPixels(column.ct, column.truth[0], 4);
  const auto found = isolated(ct, column.middles[0]);
  ASSERT_TRUE(found.has_value()) << found.error().message;
  EXPECT_GT(dice(found->label, truth), 0.85) << "a plate may lie anywhere within a slice of 5 mm";
}

TEST(Isolate, GivesTheSameFromAnyNumberOfThreadsAndProgressThatOnlyGrows) {
  const Column& column = oneAlone();
  IsolateOptions o;
  o.seed_patient = column.middles[0];
  o.threads = threadsOr(0) == 1 ? 2 : 1;
  double last = -1;
  std::string stages;
  const auto again = isolate(column.ct, o, [&](std::string_view stage, double done) {
    EXPECT_GT(done, last) << stage;
    last = done;
    stages += std::string(stage) + " ";
  });
  ASSERT_TRUE(again.has_value() && theOneAlone().has_value());
  EXPECT_EQ(again->label.inside, theOneAlone()->label.inside);
  EXPECT_EQ(last, 1);
  EXPECT_EQ(stages, "body neighbours compete edge edge ");
}

TEST(Isolate, SaysInOneLineWhatIsWrong) {
  const Column& column = threeInAColumn();
  const Frame frame = phantom::Phantom::make({}).frame();
  const auto muscle = isolated(column.ct, frame.toPatient({36, 45, 0}));
  ASSERT_FALSE(muscle.has_value());
  EXPECT_EQ(muscle.error().code, ErrorCode::NotFound);
  EXPECT_NE(muscle.error().message.find("no vertebral body at the seed"), std::string::npos) << muscle.error().message;
  const auto away = isolated(column.ct, {5000, 0, 0});
  EXPECT_EQ(away.error().code, ErrorCode::InvalidArgument);
  EXPECT_NE(away.error().message.find("the seed lies outside the volume"), std::string::npos) << away.error().message;
  for (const std::string& line : {muscle.error().message, away.error().message}) {
    EXPECT_EQ(line.find('\n'), std::string::npos);
  }
  EXPECT_EQ(isolated(column.ct, {std::numeric_limits<double>::quiet_NaN(), 0, 0}).error().code, ErrorCode::NotFinite);
  CtVolume slice = column.ct;
  slice.grid.dims[2] = 1;
  slice.hu.resize(slice.grid.voxels());
  slice.grid.origin_patient = column.ct.grid.toPatient({0, 0, std::round(column.ct.grid.toVoxel(column.middles[1]).z)});
  const auto thin = isolated(slice, slice.grid.toPatient({36, 21, 0}));
  ASSERT_FALSE(thin.has_value());
  EXPECT_EQ(thin.error().code, ErrorCode::Degenerate) << thin.error().message;
  IsolateOptions o;
  o.seed_patient = column.middles[1];
  o.threshold_hu = -1;
  EXPECT_EQ(isolate(column.ct, o).error().code, ErrorCode::InvalidArgument);
  CtVolume broken = column.ct;
  broken.hu.pop_back();
  EXPECT_EQ(isolated(broken, column.middles[1]).error().code, ErrorCode::InvalidArgument);
}

TEST(Isolate, NoiseAloneHoldsNoVertebra) {
  CtVolume ct{gridOf(kSpacing, 60), {}};
  Random random(3);
  for (std::size_t v = 0; v < ct.grid.voxels(); ++v) {
    ct.hu.push_back(static_cast<std::int16_t>(std::lround(40 + 70 * random.gaussian())));
  }
  const Vec3 middle = ct.grid.toPatient({0.5 * ct.grid.dims[0], 0.5 * ct.grid.dims[1], 0.5 * ct.grid.dims[2]});
  EXPECT_EQ(isolated(ct, middle).error().code, ErrorCode::NotFound);
}

}  // namespace
}  // namespace spinaltap::segment
