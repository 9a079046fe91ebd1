#include "core/recording/player.h"

#include <gtest/gtest.h>

#include "tests/core/recording/drills.h"

namespace spinaltap::recording {
namespace {

/// The alive bits after each accepted cycle, by stepping.
std::vector<std::vector<std::uint64_t>> stepped(const std::vector<session::Input>& inputs) {
  auto session = session::Session::create(smallVolume(), smallHeader().config).value();
  std::vector<std::vector<std::uint64_t>> states = {session.volume().alive};
  for (const session::Input& input : inputs) {
    if (session.step(input).status == session::Status::Ok) states.push_back(session.volume().alive);
  }
  return states;
}

TEST(Player, AtAnyCycleInAnyOrderHasTheVolumeThatSteppingGives) {
  const auto inputs = mixedInputs(600);
  const auto states = stepped(inputs);
  Player player = Player::create(*read(record(inputs).bytes)).value();
  ASSERT_EQ(player.cycles() + 1, states.size());
  ASSERT_NE(states.front(), states.back());
  Random random(20020430);
  for (int i = 0; i < 500; ++i) {
    const std::uint64_t cycle = random.below(states.size());
    player.seek(cycle);
    ASSERT_EQ(player.cycle(), cycle);
    ASSERT_EQ(player.volume().alive, states[cycle]) << cycle;
  }
  player.seek(~0ull);
  EXPECT_EQ(player.volume().alive, states.back());
  player.seek(0);
  EXPECT_EQ(player.volume().alive, player.before().alive);
}

TEST(Player, VerifiesAndTellsTheMomentsOfTheSession) {
  const auto inputs = mixedInputs(600);
  const Recorded recorded = record(inputs);
  const Player player = Player::create(*read(recorded.bytes)).value();
  EXPECT_TRUE(player.report().verified);
  EXPECT_EQ(player.report().state_hash, recorded.final_hash);
  EXPECT_EQ(player.header().config.engine, "reference") << "as recorded, whichever engine replays it";
  auto session = session::Session::create(smallVolume(), smallHeader().config).value();
  for (const session::Input& input : inputs) {
    const session::Output output = session.step(input);
    if (output.status != session::Status::Ok) continue;
    const Moment& moment = player.moment(output.cycle);
    EXPECT_EQ(moment.input, input);
    EXPECT_EQ(moment.thrust_N, output.thrust_N);
    EXPECT_EQ(moment.depth_mm, output.depth_mm);
    EXPECT_EQ(moment.removed_total, output.removed_total);
  }
}

TEST(Player, OfAnEmptyRecordingStaysAtItsBeginning) {
  Player player = Player::create(*read(record({}).bytes)).value();
  EXPECT_EQ(player.cycles(), 0u);
  player.seek(10);
  EXPECT_EQ(player.cycle(), 0u);
  EXPECT_EQ(player.volume().alive, smallVolume().alive);
}

TEST(Player, RefusesAnEngineThatThereIsNot) {
  Recording recording = *read(record(mixedInputs(5)).bytes);
  recording.header.config.engine = "steam";
  EXPECT_EQ(Player::create(recording).error().code, ErrorCode::NotFound);
}

}  // namespace
}  // namespace spinaltap::recording
