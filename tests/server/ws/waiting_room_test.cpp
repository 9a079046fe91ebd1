#include "server/ws/waiting_room.h"

#include <gtest/gtest.h>

namespace spinaltap::ws {
namespace {

TEST(WaitingRoom, LetsEachIdInOnceAndNotTooLate) {
  WaitingRoom room;
  const auto now = WaitingRoom::Clock::now();
  const std::string id = room.add({"c", "p"}, now).value(), late = room.add({"c", "q"}, now).value();
  EXPECT_NE(id, late);
  EXPECT_EQ(room.take(id, now + std::chrono::seconds(59))->path_id, "p");
  EXPECT_FALSE(room.take(id, now).has_value());
  EXPECT_FALSE(room.take(late, now + std::chrono::seconds(61)).has_value());
  EXPECT_FALSE(room.take("", now).has_value());
}

TEST(WaitingRoom, IsNotEndless) {
  WaitingRoom room;
  const auto now = WaitingRoom::Clock::now();
  for (std::size_t i = 0; i < WaitingRoom::kMostWaiting; ++i) ASSERT_TRUE(room.add({}, now).has_value());
  EXPECT_EQ(room.add({}, now).error().code, ErrorCode::Limit);
  EXPECT_TRUE(room.add({}, now + WaitingRoom::kPatience).has_value()) << "those who waited too long make room";
}

}  // namespace
}  // namespace spinaltap::ws
