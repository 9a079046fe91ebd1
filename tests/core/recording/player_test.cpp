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

/// Wide enough to be cut at several keyframes: most of 11,910 points go.
Recording wideDrill(std::uint64_t seed, std::vector<std::vector<std::uint64_t>>& states) {
  Random random(seed);
  Recording recording;
  recording.header = {"test", "", "", "", {{1.2, 0.8, 10}, "clearance"}};
  recording.volume = point_volume::solidVolume({0.1, 12, 30, 0}, 300).value();
  auto session = session::Session::create(recording.volume, recording.header.config).value();
  states = {session.volume().alive};
  for (std::uint64_t i = 0; i < 3000; ++i) {
    session::Input input{1000 * i, {random.uniform(-1, 1), random.uniform(-1, 1), 0.001 * static_cast<double>(i)}};
    input.axis = {random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), 1};
    if (random.below(20) == 0) input.axis = {};
    recording.inputs.push_back(input);
    if (session.step(input).status == session::Status::Ok) states.push_back(session.volume().alive);
  }
  return recording;
}

TEST(Player, JumpingOverManyKeyframesEqualsSteppingBitForBit) {
  for (const std::uint64_t seed : {20021130u, 20021201u}) {
    SCOPED_TRACE(seed);
    std::vector<std::vector<std::uint64_t>> states;
    Recording recording = wideDrill(seed, states);
    Player player = Player::create(recording).value();
    ASSERT_EQ(player.cycles() + 1, states.size());
    ASSERT_GT(player.moment(player.cycles()).removed_total, recording.volume.lattice.points() / 2);
    Random random(seed);
    for (int i = 0; i < 1000; ++i) {
      const std::uint64_t cycle = i % 10 == 0 ? player.cycles() * (i / 10 % 2) : random.below(states.size());
      player.seek(cycle);
      ASSERT_EQ(player.volume().alive, states[cycle]) << cycle;
    }
  }
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
    const Moment moment = player.moment(output.cycle);
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

TEST(Player, ShowsWhereTheBitWasThatAHandPulledAt) {
  Header header = smallHeader();
  header.config.engine = "clearance";
  header.config.speed_rpm = 750;
  header.config.coupling = haptics::Coupling{2.5, 0.001};
  std::vector<std::byte> bytes;
  auto writer = Writer::begin(header, smallVolume(), [&](std::span<const std::byte> more) {
                  bytes.insert(bytes.end(), more.begin(), more.end());
                  return true;
                }).value();
  auto session = session::Session::create(smallVolume(), header.config).value();
  std::vector<session::Output> outputs;
  for (const session::Input& input : mixedInputs(400)) {
    std::vector<std::uint32_t> removed;
    const session::Output output = session.step(
        input, [&](std::span<const std::uint32_t> some) { removed.insert(removed.end(), some.begin(), some.end()); });
    ASSERT_TRUE(writer.append(input, output, removed, session.volume()).has_value());
    if (output.status == session::Status::Ok) outputs.push_back(output);
  }
  ASSERT_TRUE(writer.finish().has_value());
  auto read_back = read(bytes);
  ASSERT_TRUE(read_back.has_value()) << read_back.error().message;
  EXPECT_EQ(read_back->header.config.speed_rpm, 750);
  EXPECT_EQ(read_back->header.config.coupling, header.config.coupling);
  const Player player = Player::create(std::move(*read_back)).value();
  EXPECT_TRUE(player.report().verified);
  ASSERT_EQ(player.cycles(), outputs.size());
  int elsewhere = 0;
  for (std::uint64_t cycle = 1; cycle <= player.cycles(); ++cycle) {
    const Moment moment = player.moment(cycle);
    EXPECT_EQ(moment.bit.tip_mm, outputs[cycle - 1].bit.tip_mm);
    EXPECT_EQ(moment.bit.axis, outputs[cycle - 1].bit.axis);
    EXPECT_EQ(moment.depth_mm, outputs[cycle - 1].depth_mm);
    elsewhere += moment.bit.tip_mm != moment.input.tip_mm;
  }
  EXPECT_GT(elsewhere, 50);
}

}  // namespace
}  // namespace spinaltap::recording
