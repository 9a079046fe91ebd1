#include "core/haptics/local_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <deque>

#include "core/base/random.h"

namespace spinaltap::haptics {
namespace {

LocalModel wallAt(const Rod& bit, double first_mm2) {
  LocalModel model;
  model.bit = bit;
  model.frontal_mm2 = {static_cast<float>(first_mm2), 0.2F, 0.3F, 0.4F, 0.5F};
  return model;
}

TEST(LocalModel, KeepsWhatSidesAndTipMeet) {
  Random random(31);
  Meeting meeting;
  meeting.frontal_mm2 = 1.25, meeting.rubbing_mm2 = 3.5;
  double area = 0;
  for (std::size_t i = 0; i < 24; ++i) {
    const double turn = static_cast<double>(i) / 24, a = random.uniform(0.1, 1);
    meeting.sides[meeting.side_count++] = {std::cos(6.2831853 * turn), std::sin(6.2831853 * turn), 0.1, a};
    area += a;
  }
  const LocalModel model = localModel({{1, 2, 3}, {0, 0, 1}}, meeting, {1.25, 1.5, 1.75, 2, 2.5});
  double kept = 0;
  for (std::size_t i = 0; i < kLocalSides; ++i) {
    kept += static_cast<double>(model.side_mm2[i]);
    EXPECT_NEAR(model.side_lever[i], 0.1, 1e-6);
  }
  EXPECT_NEAR(kept, area, 1e-5);
  const Meeting back = meetingOf(model, 0, true);
  EXPECT_EQ(back.frontal_mm2, 1.25);
  EXPECT_EQ(back.rubbing_mm2, 3.5);
  EXPECT_EQ(back.side_count, kLocalSides);
}

TEST(LocalModel, TellsWhatIsAheadByStraightLinesAndAStoppedBitByTheNearerDepth) {
  const LocalModel model = wallAt({}, 0.0);
  const LocalModel cutting = [] {
    LocalModel m = wallAt({}, 0.0);
    m.frontal_mm2[0] = 0.5F;
    return m;
  }();
  EXPECT_EQ(meetingOf(cutting, -0.06, true).frontal_mm2, 0) << "behind the bit is its hole";
  EXPECT_EQ(meetingOf(cutting, -0.04, true).frontal_mm2, 0.5) << "but its facets look a spacing ahead";
  EXPECT_NEAR(meetingOf(model, 0.125, true).frontal_mm2, 0.1, 1e-7);
  EXPECT_NEAR(meetingOf(model, 0.75, true).frontal_mm2, 0.35, 1e-7);
  EXPECT_NEAR(meetingOf(model, 9, true).frontal_mm2, 0.5, 1e-7) << "beyond, as at the last";
  EXPECT_EQ(meetingOf(model, 0.12, false).frontal_mm2, 0);
  EXPECT_NEAR(meetingOf(model, 0.13, false).frontal_mm2, 0.2, 1e-7);
}

TEST(LocalBit, StandsAtAWallThatTheServerToldOfBeforeItWasReached) {
  LocalBit bit({5, 0}, {});
  bit.place({});
  (void)bit.step(1, {}, 0.001, false, 0);
  bit.learn(1, wallAt({}, 0.0));  // free where it stands, bone from an eighth of a millimetre on
  Reaction reaction;
  for (std::uint32_t i = 2; i < 200; ++i) {
    reaction = bit.step(i, {{0, 0, 0.02 * i}, {0, 0, 1}}, 0.001, false, 0);
    ASSERT_LT(bit.rod().tip_mm.z, 0.125 + 0.011) << "a shortest step past it";
  }
  EXPECT_NEAR(reaction.force_N.z, -5 * (0.02 * 199 - bit.rod().tip_mm.z), 1e-9);
}

TEST(LocalBit, FindsBackToTheServersBitAsFarAsTheReserveAllows) {
  for (const double reserve : {0.0, 1e9}) {
    LocalBit bit({5, 0}, {});
    bit.place({});
    const Rod hand;
    LocalModel model;  // the server's bit is 1 mm behind ours, and meets nothing
    model.bit.tip_mm = {0, 0, -1};
    model.frontal_mm2 = {1, 1, 1, 1, 1};
    double spring = 0;
    for (std::uint32_t i = 1; i < 400; ++i) {
      (void)bit.step(i, hand, 0.001, false, reserve);
      if (i == 1) bit.learn(1, model);
      spring = 2.5 * dot(hand.tip_mm - bit.rod().tip_mm, hand.tip_mm - bit.rod().tip_mm);
    }
    if (reserve == 0) {
      EXPECT_LT(spring, 1e-9) << "no energy was put in, so none is made";
    } else {
      EXPECT_NEAR(bit.rod().tip_mm.z, -1, 1e-3) << "twenty times the time of reckoning";
    }
  }
}

TEST(LocalBit, IgnoresAnswersOutOfOrderAndThoseItDoesNotRemember) {
  LocalBit a({5, 0}, {}), b({5, 0}, {});
  a.place({}), b.place({});
  for (std::uint32_t i = 0xfffffff0u; i != 5; ++i) {  // across the end of the numbers
    (void)a.step(i, {}, 0.001, true, 0);
    (void)b.step(i, {}, 0.001, true, 0);
  }
  LocalModel newer, older;
  newer.bit.tip_mm = {0, 0, 0.5}, older.bit.tip_mm = {0, 0, -7};
  a.learn(3, newer), b.learn(3, newer);
  a.learn(1, older);            // late
  a.learn(0xfffffff4u, older);  // later still
  a.learn(77, older);           // never sent
  for (std::uint32_t i = 5; i < 50; ++i) {
    (void)a.step(i, {}, 0.001, true, 1e9);
    (void)b.step(i, {}, 0.001, true, 1e9);
    ASSERT_EQ(a.rod().tip_mm, b.rod().tip_mm);
  }
}

}  // namespace
}  // namespace spinaltap::haptics
