#include "core/point_volume/lattice.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace spinaltap::point_volume {
namespace {

plan::Path pathOf(double length_mm, double radius_mm, double spacing_mm, double lead_mm = 0) {
  plan::Path path;
  path.target_patient = {0, 0, length_mm};
  path.volume_radius_mm = radius_mm;
  path.spacing_mm = spacing_mm;
  path.lead_mm = lead_mm;
  return path;
}

TEST(Lattice, HasTheReportsPointCounts) {
  EXPECT_EQ(latticeOf(pathOf(10, 4, 0.1)).pointsPerDisc(), 4681u);
  EXPECT_EQ(latticeOf(pathOf(10, 4, 0.1)).points(), 468100u);
  EXPECT_EQ(latticeOf(pathOf(10, 4, 0.05)).pointsPerDisc(), 18961u);
  EXPECT_EQ(latticeOf(pathOf(10, 4, 0.05)).points(), 3792200u);
  EXPECT_EQ(latticeOf(pathOf(37.8, 3, 0.1)).points(), 986958u);
}

TEST(Lattice, BeginsBeforeTheEntryByItsLead) {
  const Lattice lattice = latticeOf(pathOf(10, 4, 0.1, 2.5));
  EXPECT_EQ(lattice.first_disc, -25);
  EXPECT_EQ(lattice.discs, 125);
  EXPECT_EQ(lattice.discZ_mm(25), 0.0);
  EXPECT_NEAR(lattice.discZ_mm(0), -2.5, 1e-12);
}

TEST(Lattice, NumbersItsSitesWithoutGapsAndFindsEachOneAgain) {
  for (const int rings : {1, 2, 3, 30, 60}) {
    const Lattice lattice{0.1, rings, 3, -1};
    std::uint32_t next = 0;
    for (int disc = 0; disc < lattice.discs; ++disc) {
      for (int ring = 0; ring < rings; ++ring) {
        for (int slot = 0; slot < Lattice::slotsOf(ring); ++slot, ++next) {
          ASSERT_EQ(lattice.index({disc, ring, slot}), next);
          ASSERT_EQ(lattice.site(next), (Site{disc, ring, slot}));
        }
      }
    }
    EXPECT_EQ(next, lattice.points());
  }
}

TEST(Lattice, FindsSitesNearTheLimitOfItsIndices) {
  const Lattice lattice{0.001, 9999, 7, 0};  // almost 2^31 points
  ASSERT_TRUE(checkLattice(lattice).has_value());
  for (std::uint32_t back = 1; back < 1000000; back += 997) {
    const auto index = static_cast<std::uint32_t>(lattice.points() - back);
    ASSERT_EQ(lattice.index(lattice.site(index)), index);
  }
}

TEST(Lattice, IsRefusedWhenEmptyHugeOrNotFinite) {
  EXPECT_TRUE(checkLattice({0.1, 1, 1, 0}).has_value());
  EXPECT_EQ(checkLattice({0.1, 0, 1, 0}).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(checkLattice({0.1, 1, 0, 0}).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(checkLattice({0.1, -5, -5, 0}).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(checkLattice({0.0, 1, 1, 0}).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(checkLattice({-0.1, 1, 1, 0}).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(checkLattice({0.1, 40, 460000, 0}).error().code, ErrorCode::Limit);
  EXPECT_EQ(checkLattice({0.1, 2147483647, 2147483647, 0}).error().code, ErrorCode::Limit);
  EXPECT_EQ(checkLattice({0.001, 10001, 1, 0}).error().code, ErrorCode::Limit);
  EXPECT_EQ(checkLattice({0.1, 2, 10, 2147483647}).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(checkLattice({0.1, 2, 10, -2147483647 - 1}).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(checkLattice({std::numeric_limits<double>::quiet_NaN(), 2, 2, 0}).error().code, ErrorCode::NotFinite);
  EXPECT_EQ(checkLattice({std::numeric_limits<double>::infinity(), 2, 2, 0}).error().code, ErrorCode::NotFinite);
}

TEST(DiscTable, HoldsEveryPointOnItsRingAtItsAngle) {
  const Lattice lattice{0.1, 40, 1, 0};
  const DiscTable table = discTable(lattice);
  ASSERT_EQ(table.x_mm.size(), lattice.pointsPerDisc());
  ASSERT_EQ(table.y_mm.size(), lattice.pointsPerDisc());
  const long double turn = 2 * std::acos(-1.0L);
  for (std::uint32_t i = 0; i < lattice.pointsPerDisc(); ++i) {
    const Site site = lattice.site(i);
    const long double radius = 0.1L * site.ring, angle = turn * site.slot / Lattice::slotsOf(site.ring);
    // Sine and cosine are good to 4.5e-16, times a radius below 4 mm.
    ASSERT_NEAR(table.x_mm[i], static_cast<double>(radius * std::cos(angle)), 4e-15);
    ASSERT_NEAR(table.y_mm[i], static_cast<double>(radius * std::sin(angle)), 4e-15);
  }
}

TEST(DiscTable, KeepsNeighboursOnARingBetweenOneSpacingAndItsArc) {
  // Section 6.4 of the report: ring 1 has chord 0.100, rings beyond tend to 0.1047.
  const Lattice lattice{0.1, 40, 1, 0};
  const DiscTable table = discTable(lattice);
  for (int ring = 1; ring < lattice.rings; ++ring) {
    const std::uint32_t a = lattice.index({0, ring, 0}), b = lattice.index({0, ring, 1});
    const double chord = std::hypot(table.x_mm[a] - table.x_mm[b], table.y_mm[a] - table.y_mm[b]);
    EXPECT_GT(chord, 0.1 - 1e-12);
    EXPECT_LT(chord, 0.10472);
  }
}

TEST(PositionOf, IsThatOfTheDiscsTable) {
  const Lattice lattice{0.1, 12, 3, -1};
  const DiscTable table = discTable(lattice);
  for (std::uint32_t p = 0; p < lattice.points(); ++p) {
    const std::uint32_t in_disc = p % lattice.pointsPerDisc();
    const Vec3 there{table.x_mm[in_disc], table.y_mm[in_disc], lattice.discZ_mm(lattice.site(p).disc)};
    ASSERT_EQ(positionOf(lattice, p), there);
  }
}

TEST(PointVolume, OfOnePointTimesThePointsIsTheCylinder) {
  const Lattice lattice{0.1, 40, 100, 0};
  // Rings 0 .. n-1 stand for the annuli up to (n - 1/2) spacings; the centre is counted at 4/3 of its share.
  const double radius = 39.5 * 0.1, cylinder = std::acos(-1.0) * radius * radius * 10.0;
  EXPECT_NEAR(pointVolume_mm3(lattice) * static_cast<double>(lattice.points()) / cylinder, 1.0, 1e-4);
}

}  // namespace
}  // namespace spinaltap::point_volume
