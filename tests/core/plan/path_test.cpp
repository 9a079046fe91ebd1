#include "core/plan/path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/base/random.h"

namespace spinaltap::plan {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

Path goodPath() {
  Path path;
  path.entry_patient = {10, -20, 30};
  path.target_patient = {15, -50, 28};
  return path;
}

ErrorCode codeOf(const Path& path) {
  const auto result = checkPath(path);
  EXPECT_FALSE(result.has_value());
  EXPECT_EQ(result.error().message.find('\n'), std::string::npos);
  return result.error().code;
}

TEST(CheckBit, AcceptsTheReportsBitAFlatEndAndTheExtremes) {
  EXPECT_TRUE(checkBit({3.0, 5.0, 50.0}).has_value());
  EXPECT_TRUE(checkBit({0.5, 0.0, 1e-3}).has_value());
  EXPECT_TRUE(checkBit({8.0, 200.0, 200.0}).has_value());
}

TEST(CheckBit, RefusesWhatIsNoBit) {
  const std::vector<Bit> bad = {{0.49, 5, 50}, {8.01, 5, 50}, {3, -1, 50}, {3, 51, 50}, {3, 0, 0}, {3, 5, 201}};
  for (const Bit& bit : bad) EXPECT_EQ(checkBit(bit).error().code, ErrorCode::InvalidArgument);
  for (const double v : {kNan, kInf, -kInf}) {
    EXPECT_EQ(checkBit({v, 5, 50}).error().code, ErrorCode::NotFinite);
    EXPECT_EQ(checkBit({3, v, 50}).error().code, ErrorCode::NotFinite);
    EXPECT_EQ(checkBit({3, 5, v}).error().code, ErrorCode::NotFinite);
  }
}

TEST(CheckPath, AcceptsAPathAKilometreFromTheScannersOrigin) {
  Path path = goodPath();
  EXPECT_TRUE(checkPath(path).has_value());
  path.entry_patient += Vec3{1e6, -1e6, 1e6};
  path.target_patient += Vec3{1e6, -1e6, 1e6};
  EXPECT_TRUE(checkPath(path).has_value());
}

TEST(CheckPath, RefusesNumbersThatAreNotFiniteWhereverTheyStand) {
  for (const double v : {kNan, kInf, -kInf}) {
    for (int field = 0; field < 9; ++field) {
      Path path = goodPath();
      double* fields[] = {&path.entry_patient.x,  &path.entry_patient.y,  &path.entry_patient.z,
                          &path.target_patient.x, &path.target_patient.y, &path.target_patient.z,
                          &path.volume_radius_mm, &path.lead_mm,          &path.spacing_mm};
      *fields[field] = v;
      EXPECT_EQ(codeOf(path), ErrorCode::NotFinite) << field;
    }
  }
}

TEST(CheckPath, RefusesAPathWithoutLengthAndOneShorterThanASpacing) {
  Path path = goodPath();
  path.target_patient = path.entry_patient;
  EXPECT_EQ(codeOf(path), ErrorCode::Degenerate);
  path.target_patient.x += 0.099;
  EXPECT_EQ(codeOf(path), ErrorCode::Degenerate);
}

TEST(CheckPath, RefusesABitWiderThanTheVolumeAndAcceptsOneExactlyAsWide) {
  Path path = goodPath();
  path.bit.diameter_mm = 8.0;
  EXPECT_TRUE(checkPath(path).has_value());
  path.volume_radius_mm = 3.9;
  EXPECT_EQ(codeOf(path), ErrorCode::InvalidArgument);
}

TEST(CheckPath, RefusesSpacingsLeadsAndRadiiOutsideTheirRange) {
  for (const double spacing : {0.0, -0.1, 0.0099, 1.01}) {
    Path path = goodPath();
    path.spacing_mm = spacing;
    EXPECT_EQ(codeOf(path), ErrorCode::InvalidArgument);
  }
  Path path = goodPath();
  path.lead_mm = -1;
  EXPECT_EQ(codeOf(path), ErrorCode::InvalidArgument);
  path = goodPath();
  path.volume_radius_mm = 51;
  EXPECT_EQ(codeOf(path), ErrorCode::InvalidArgument);
}

TEST(CheckPath, RefusesAVolumeOfTwoToThe31Points) {
  Path path = goodPath();
  path.spacing_mm = 0.01;
  path.volume_radius_mm = 10;
  EXPECT_EQ(codeOf(path), ErrorCode::Limit);
}

TEST(PathFrame, IsRightHandedOrthonormalAndTakesTheTargetOntoZ) {
  Random random(7);
  for (int i = 0; i < 2000; ++i) {
    Path path = goodPath();
    const Vec3 step{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    if (norm(step) < 0.01) continue;
    path.target_patient = path.entry_patient + step * 40;
    const Frame frame = pathFrame(path);
    const Mat3& a = frame.axes;
    // A handful of operations on numbers below 100: 1e-13 is a hundred times their rounding.
    EXPECT_NEAR(dot(a.col_x, a.col_y), 0, 1e-13);
    EXPECT_NEAR(dot(a.col_y, a.col_z), 0, 1e-13);
    EXPECT_NEAR(dot(a.col_x, a.col_z), 0, 1e-13);
    EXPECT_NEAR(norm(a.col_x), 1, 1e-13);
    EXPECT_NEAR(dot(cross(a.col_x, a.col_y), a.col_z), 1, 1e-13);
    const Vec3 target = frame.toLocal(path.target_patient);
    EXPECT_NEAR(norm(target - Vec3{0, 0, length(path)}), 0, 1e-12);
    EXPECT_EQ(frame.toLocal(path.entry_patient), (Vec3{0, 0, 0}));
  }
}

TEST(PathFrame, HasItsXOnThePatientAxisLeastAlongThePath) {
  Path path = goodPath();
  path.entry_patient = {0, 0, 0};
  path.target_patient = {1, 30, 20};
  EXPECT_GT(pathFrame(path).axes.col_x.x, 0.99);
  path.target_patient = {20, 1, 30};
  EXPECT_GT(pathFrame(path).axes.col_x.y, 0.99);
  path.target_patient = {20, 30, 1};
  EXPECT_GT(pathFrame(path).axes.col_x.z, 0.99);
  path.target_patient = {0, 0, 10};
  EXPECT_EQ(pathFrame(path).axes.col_x, (Vec3{1, 0, 0}));
}

}  // namespace
}  // namespace spinaltap::plan
