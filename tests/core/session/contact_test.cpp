#include "core/session/contact.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/base/dmath.h"
#include "core/base/random.h"
#include "core/session/session.h"

namespace spinaltap::session {
namespace {

using point_volume::Lattice;
using point_volume::PointVolume;

constexpr Lattice kLattice{0.2, 20, 80, -10};

PointVolume patchy(Random& random) {
  PointVolume volume = *point_volume::solidVolume(kLattice, 1);
  for (auto& density : volume.density_mg_cm3) density = static_cast<std::uint16_t>(100 + random.below(1500));
  for (auto& alive : volume.alive) alive &= random.bits();
  return volume;
}

TEST(Contact, AddsUpWhatEveryFacetMeets) {
  Random random(61);
  const PointVolume volume = patchy(random);
  int sides = 0;
  for (int n = 0; n < 400; ++n) {
    plan::Bit bit{random.uniform(0.5, 4), 0, random.uniform(6, 20)};
    bit.cone_length_mm = random.below(3) == 0 ? 0 : random.uniform(0.1, 6);
    const Contact contact(kLattice, bit);
    const drill::Probe probe(kLattice, bit);
    const SinCos tilt = sinCos(random.uniform(0, 0.6)), at = sinCos(random.uniform(0, 2 * kPi));
    const double x = random.uniform(-2, 2), y = random.uniform(-2, 2), z = random.uniform(-4, 14);
    const drill::BitPose pose{{x, y, z}, {tilt.sin * at.cos, tilt.sin * at.sin, tilt.cos}};
    const Vec3 tool_x = haptics::toolX(pose.axis), tool_y = haptics::toolY(pose.axis);
    std::array<std::uint16_t, drill::Probe::kMostFacets> densities{};
    probe.look(volume, pose, tool_x, tool_y, densities);
    double frontal = 0, rubbing = 0, push_x = 0, push_y = 0;
    for (std::size_t i = 0; i < probe.count(); ++i) {
      const double hardness = densities[i] / 1850.0 * (densities[i] / 1850.0);
      const double side = hardness * probe.areaOf(i).side_mm2;
      frontal += hardness * probe.areaOf(i).frontal_mm2;
      rubbing += i < drill::Probe::kTipFacets ? 0 : side;
      push_x += side * probe.facet(i).out_x, push_y += side * probe.facet(i).out_y;
    }
    const haptics::Meeting meeting = contact.meet(volume, pose);
    // Sums of at most 128 terms in another order: some 1e-14 of them.
    const double size = 1e-12 * (1 + frontal + rubbing);
    EXPECT_NEAR(meeting.frontal_mm2, frontal, size);
    EXPECT_NEAR(meeting.rubbing_mm2, rubbing, size);
    EXPECT_EQ(contact.frontal_mm2(volume, pose), meeting.frontal_mm2);
    double met_x = 0, met_y = 0;
    for (std::size_t i = 0; i < meeting.side_count; ++i) {
      const haptics::SideContact& side = meeting.sides[i];
      EXPECT_NEAR(std::hypot(side.x, side.y), 1, 1e-12);
      EXPECT_GE(side.lever, 0);
      EXPECT_LE(side.lever, (bit.length_mm + 0.2) / haptics::kGrip_mm);
      met_x += side.area_mm2 * side.x, met_y += side.area_mm2 * side.y;
    }
    EXPECT_NEAR(met_x, push_x, 10 * size);
    EXPECT_NEAR(met_y, push_y, 10 * size);
    sides += static_cast<int>(meeting.side_count);
  }
  EXPECT_GT(sides, 2000);
}

TEST(Contact, MeetsTheSidesOfAHoleFromAllAround) {
  PointVolume volume = *point_volume::solidVolume(kLattice, 1850);
  const plan::Bit bit{3, 5, 12};
  const drill::BitPose pose{{0, 0, 11}, {0, 0, 1}};
  (void)(*drill::makeEngine("bounded", volume, bit))->step(volume, pose);
  const haptics::Meeting meeting = Contact(kLattice, bit).meet(volume, pose);
  EXPECT_EQ(meeting.side_count, haptics::kMostSides);
  EXPECT_NEAR(meeting.frontal_mm2, kPi * 1.5 * 1.5, 1e-9) << "the whole tip, at hardness 1";
  // The sides' pushes cancel but for how 64 facets spread: each is a sixty-fourth of the whole.
  double x = 0, y = 0, whole = 0;
  for (std::size_t i = 0; i < meeting.side_count; ++i) {
    x += meeting.sides[i].x * meeting.sides[i].area_mm2, y += meeting.sides[i].y * meeting.sides[i].area_mm2;
    whole += meeting.sides[i].area_mm2;
  }
  EXPECT_LT(std::hypot(x, y), whole / 64 * 3);
}

TEST(LocalModel, TellsOfBoneAheadWhatABitThatStandsThereMeets) {
  Random random(62);
  const PointVolume volume = patchy(random);
  const plan::Bit bit{3, 5, 20};
  const auto modelAt = [&](double z_mm) {
    Session session = Session::create(volume, Config{bit}).value();
    Input input;
    input.tip_mm = {0.1, -0.2, z_mm}, input.axis = {0.05, 0.02, 1};
    (void)session.step(input);
    return session.localModel();
  };
  const Vec3 axis = normalized(Vec3{0.05, 0.02, 1});
  const haptics::LocalModel model = modelAt(3);
  for (std::size_t i = 1; i < haptics::kDepthsAhead; ++i) {
    Session there = Session::create(volume, Config{bit}).value();
    Input input;
    input.tip_mm = model.bit.tip_mm + axis * haptics::kAhead_mm[i], input.axis = axis;
    (void)there.step(input);
    EXPECT_EQ(model.frontal_mm2[i], there.localModel().frontal_mm2[0]) << i;
    EXPECT_GT(model.frontal_mm2[i], 0) << i;
  }
}

}  // namespace
}  // namespace spinaltap::session
