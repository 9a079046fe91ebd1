#include "core/haptics/port.h"

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/haptics/holding.h"

namespace spinaltap::haptics {
namespace {

Rod rodAt(double z, const Vec3& axis = {0, 0, 1}) { return {{0, 0, z}, axis}; }

PortLimits limits(double scale, double max_N, double brake = 0, bool torque = true) {
  PortLimits made;
  made.force_scale = scale, made.max_force_N = max_N, made.most_brake_N_s_mm = brake, made.renders_torque = torque;
  return made;
}

TEST(Port, ScalesThenShortensForceAndTorqueTogetherAndSaysSo) {
  Port port({}, {}, limits(0.5, 3.0));
  const Port::Felt whole = port.push(rodAt(0), {0, 3, -4}, {10, 0, 0}, 0.001);
  EXPECT_EQ(whole.force_N, (Vec3{0, 1.5, -2}));
  EXPECT_EQ(whole.torque_Nmm, (Vec3{5, 0, 0}));
  EXPECT_FALSE(whole.limited);
  const Port::Felt cut = port.push(rodAt(0), {0, 6, -8}, {10, 0, 0}, 0.001);  // 5 N for a device of 3
  EXPECT_TRUE(cut.limited);
  EXPECT_NEAR(norm(cut.force_N), 3, 1e-12);
  EXPECT_NEAR(cut.force_N.y / cut.force_N.z, -0.75, 1e-12) << "the direction is kept";
  EXPECT_NEAR(cut.torque_Nmm.x, 3, 1e-12) << "of 5 N mm, three fifths";
}

TEST(Port, CountsWhatATorqueGivesOnlyWhereMotorsMakeOne) {
  const double angle = 0.001;
  const Vec3 turned{0, -angle, std::sqrt(1 - angle * angle)};  // about x, by the right hand
  for (const bool motors : {true, false}) {
    Port port({}, {}, limits(1, 0, 0, motors));
    EXPECT_EQ(port.push(rodAt(0), {}, {200, 0, 0}, 0.001).torque_Nmm, (Vec3{motors ? 200.0 : 0.0, 0, 0}));
    std::ignore = port.push(rodAt(0, turned), {}, {}, 0.001);
    EXPECT_NEAR(port.guard().given_mJ(), motors ? 200 * angle : 0, 1e-12);
  }
}

TEST(Port, NeverPushesHarderThanTheDeviceCanTheBrakeIncluded) {
  Random random(7);
  Port port({}, {}, limits(1, 3.3, 0.1));
  double z = 0;
  for (int i = 0; i < 2000; ++i) {
    z += 0.2 * (random.unit() - 0.5);
    const Vec3 wanted{4 * random.unit() - 2, 0, 6 * random.unit() - 2};  // on the whole it pushes, and so gives
    EXPECT_LE(norm(port.push(rodAt(z), wanted, {}, 0.001).force_N), 3.3 * (1 + 1e-12)) << i;
  }
  EXPECT_GT(port.guard().braked(), 0u);
}

TEST(Port, LetsALimitedForceBeFeltWithoutMakingEnergyOfIt) {
  // A wall that a relaxed hand is drawn into by 8 mm: the spring asks for more than the device has, either way.
  const Coupling coupling{2, 0};
  Port port(coupling, {}, limits(1, 0.5, 0.05));
  LocalModel wall;
  wall.frontal_mm2.fill(7);
  Hand hand(relaxedGrip());
  port.place(rodAt(0));
  Vec3 force_N;
  std::uint64_t limited = 0;
  double fastest_mm_s = 0;
  for (std::uint32_t seq = 0; seq < 3000; ++seq) {
    const Rod rod{hand.at_mm(), {0, 0, 1}};
    const Reaction bone = port.move(seq, rod, 0.001, false);
    port.learn(seq, wall);
    const Port::Felt felt = port.push(rod, fromTool(port.rod().axis, bone.force_N), {}, 0.001);
    force_N = felt.force_N, limited += felt.limited ? 1 : 0;
    const Vec3 meant{0, 0, seq < 1500 ? 8.0 : -2.0};
    for (int tick = 0; tick < 20; ++tick) hand.step(meant, {}, force_N, 5e-5);
    fastest_mm_s = std::max(fastest_mm_s, norm(hand.velocity_mm_s()));
  }
  EXPECT_GT(limited, 1000u);
  // A force that is held for a period gives at most that period's way more than the spring has: 0.5 N, at both turns.
  EXPECT_LE(port.guard().mostGiven_mJ(), 2 * 0.5 * fastest_mm_s * 0.001);
}

TEST(Holding, IsNamedGrippedAndMeansToGoAhead) {
  for (const Holding holding : kHoldings) {
    EXPECT_FALSE(nameOf(holding).empty());
    EXPECT_GT(gripOf(holding).mass_kg, 0);
    EXPECT_GT(meantAt(holding, {-1, 2}, 3).z, 4.7) << nameOf(holding);
  }
  EXPECT_EQ(meantAt(Holding::Tense, {-1, 2}, 3), (Vec3{0, 0, 5}));
  EXPECT_DOUBLE_EQ(gripOf(Holding::Leaning).stiffness_N_mm * meantAt(Holding::Leaning, {}, 0).z, 25);
}

}  // namespace
}  // namespace spinaltap::haptics
