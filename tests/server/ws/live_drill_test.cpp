// What a device gets of a drill's force. (What a drill does is tested over its protocol: drill_hub_test.cpp.)
#include "server/ws/live_drill.h"

#include <gtest/gtest.h>

#include "core/haptics/proxy.h"
#include "tests/server/ws/live_drill.h"

namespace spinaltap::ws {
namespace {
using namespace test;

TEST(Device, ACouplingIsAsStiffAsAskedForByDefaultAndAsTheDeviceCanHold) {
  wire::Hello hello;
  EXPECT_EQ(couplingFor(hello)->stiffness_N_mm, haptics::kStiffness_N_mm);
  hello.max_stiffness_N_mm = 1000;
  EXPECT_EQ(couplingFor(hello)->stiffness_N_mm, haptics::kStiffness_N_mm);
  hello.max_stiffness_N_mm = 2;
  EXPECT_EQ(couplingFor(hello)->stiffness_N_mm, 2);
  hello.damping_N_s_mm = 0.0005, hello.device_rate_hz = 1000;
  EXPECT_EQ(couplingFor(hello)->stiffness_N_mm, 0.75 * 2 * 0.0005 / 0.001);
  hello.damping_N_s_mm = 0;
  EXPECT_EQ(couplingFor(hello)->stiffness_N_mm, 2) << "of a device that does not say";
  hello.max_stiffness_N_mm = 1e-300;
  EXPECT_GT(couplingFor(hello)->stiffness_N_mm, 0);
  EXPECT_FALSE(couplingFor(rigidHello()).has_value());
}

TEST(Device, AForceIsScaledDownToTheDeviceAndNeverUp) {
  wire::Hello hello;
  EXPECT_EQ(forceScaleFor(hello), 1);
  hello.max_force_N = haptics::kFullForce_N / 8;
  EXPECT_EQ(forceScaleFor(hello), 0.125);
  hello.max_force_N = 2 * haptics::kFullForce_N;
  EXPECT_EQ(forceScaleFor(hello), 1);
}

}  // namespace
}  // namespace spinaltap::ws
