// The reference client on the real server, over TCP on loopback, with simulated hands.
#include "server/haptic_client/client.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <thread>

#include "core/recording/recording.h"
#include "server/jobs/drill_job.h"
#include "tests/server/haptic_client/hands.h"
#include "tests/server/haptic_client/relay.h"
#include "tests/server/program.h"
#include "tests/server/small_case.h"
#include "tests/server/temporary_folder.h"

namespace spinaltap::haptic_client {
namespace {
using namespace test;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr seconds kForever{60};  // for what takes milliseconds

class HapticClient : public testing::Test {
 protected:
  TemporaryFolder folder_;
  store::Store store_ = store::Store::open(folder_.path()).value();
  SmallCase small_ = makeSmallCase(store_);
  Server server_{folder_.path().string()};

  ClientSetup setupAt(int port, Pace pace = Pace::Lockstep) {
    ClientSetup setup;
    setup.server = {"127.0.0.1", static_cast<std::uint16_t>(port)};
    setup.case_id = small_.case_id, setup.path_id = small_.path_id;
    setup.pace = pace;
    return setup;
  }
  recording::Recording recordingOf(const std::string& id) {
    return recording::read(store_.blobs().get(store_.findRecording(id).value().bytes).value()).value();
  }
  /// The recording holds what was sent, no pose less or twice, and replays.
  void expectWhole(const Outcome& outcome, const std::vector<Vec3>& sent) {
    const recording::Recording kept = recordingOf(outcome.recording_id);
    EXPECT_TRUE(kept.complete);
    ASSERT_EQ(kept.inputs.size(), outcome.tally.sent);
    ASSERT_EQ(kept.inputs.size(), sent.size());
    for (std::size_t i = 0; i < sent.size(); ++i) ASSERT_EQ(kept.inputs[i].tip_mm, sent[i]) << i;
    const auto report = recording::replay(kept).value();
    EXPECT_TRUE(report.verified);
    EXPECT_EQ(report.cycles, outcome.tally.sent);
  }
};

VirtualHand handOf(haptics::Holding holding) {
  VirtualHand hand;
  hand.holding = holding;
  return hand;
}

/// Adds the poses that are sent to `sent`.
auto keepSent(std::vector<Vec3>& sent) {
  return [&sent](const Tick& tick) {
    if (tick.sent > sent.size()) sent.push_back(tick.hand.tip_mm);
  };
}
template <class Condition>
bool waitUntil(const Condition& condition) {
  const auto end = std::chrono::steady_clock::now() + kForever;
  while (!condition() && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(milliseconds(1));
  return condition();
}

/// The same hand, with nothing but the session in this process between it and the bone.
struct Offline {
  double depth_mm = 0, mean_N = 0;
  std::vector<double> hand_mm;
};
Offline drillOffline(store::Store& store, const SmallCase& small, const VirtualHand& how, int ticks) {
  jobs::DrillSite site = jobs::siteOfPath(store, small.case_id, small.path_id).value();
  site.config.coupling = haptics::Coupling{};
  session::Session session = session::Session::create(std::move(site.volume), site.config).value();
  VirtualDevice hand(how, {});
  EXPECT_TRUE(hand.open().has_value());
  hand.holds(true);
  Offline result;
  for (int i = 1; i <= ticks; ++i) {
    session::Input input;
    input.t_us = static_cast<std::uint64_t>(i) * 1000;
    input.tip_mm = hand.read(input.t_us).value().tip_mm;
    result.hand_mm.push_back(input.tip_mm.z);
    const session::Output output = session.step(input);
    result.depth_mm = output.depth_mm, result.mean_N += output.thrust_N / ticks;
    EXPECT_TRUE(hand.push(haptics::fromTool(output.bit.axis, output.force_N), {}).has_value());
  }
  return result;
}

TEST_F(HapticClient, DrillsToTheSameDepthWithTheSameForceAsTheSameHandOffline) {
  constexpr int kTicks = 3000;
  for (const haptics::Holding holding : {haptics::Holding::Tense, haptics::Holding::Relaxed}) {
    const VirtualHand how = handOf(holding);
    const Offline offline = drillOffline(store_, small_, how, kTicks);
    VirtualDevice device(how, {});
    ClientSetup setup = setupAt(server_.port());
    double mean_N = 0, mean_apart_N = 0, depth_mm = 0, hand_apart_mm = 0;
    std::vector<Vec3> sent;
    setup.on_tick = [&, keep = keepSent(sent)](const Tick& tick, double) {
      keep(tick);
      return tick.sent < kTicks + 1;  // one pose to greet
    };
    setup.on_answer = [&](const Answered& answered) {
      const wire::Feedback& f = answered.answer.feedback;
      if (f.seq == 0 || f.seq > kTicks) return;
      depth_mm = f.depth_mm, mean_N += f.thrust_N / kTicks;
      mean_apart_N += (-answered.tick.felt.force_N.z - f.thrust_N) / kTicks;
      hand_apart_mm = std::max(hand_apart_mm, std::abs(answered.tick.hand.tip_mm.z - offline.hand_mm[f.seq - 1]));
    };
    const auto client = Client::start(setup, device).value();
    ASSERT_TRUE(waitUntil([&] { return !client->isRunning(); }));
    const Outcome outcome = client->finish().value();
    // What is felt is the client's own bit, which lives on the answer of the tick before. The issue's own measure:
    EXPECT_NEAR(depth_mm, offline.depth_mm, 0.03 * offline.depth_mm) << haptics::nameOf(holding);
    EXPECT_NEAR(mean_N, offline.mean_N, 0.03 * offline.mean_N) << haptics::nameOf(holding);
    // And by the hand's own balance over the time: mass, damper, spring and force add up to nothing in both, so means
    // of the force that is felt differ by what the spring and the damper see of the hands' difference, and by a mass
    // whose speed at the end is another by at most the feed.
    const haptics::Grip grip = haptics::gripOf(holding);
    const double over_s = 0.001 * kTicks;
    EXPECT_NEAR(mean_N + mean_apart_N, offline.mean_N,
                grip.stiffness_N_mm * hand_apart_mm + grip.damping_N_s_mm * hand_apart_mm / over_s +
                    grip.mass_kg / 1000 * how.approach.feed_mm_s / over_s)
        << haptics::nameOf(holding);
    EXPECT_LT(std::abs(mean_apart_N), 0.03 * mean_N) << "the force that is felt is the bone's";
    RecordProperty(std::string(haptics::nameOf(holding)),
                   std::to_string(depth_mm) + " mm, offline " + std::to_string(offline.depth_mm) + "; " +
                       std::to_string(mean_N) + " N, offline " + std::to_string(offline.mean_N) + "; felt " +
                       std::to_string(mean_apart_N) + " N more; hands apart " + std::to_string(hand_apart_mm) + " mm");
    expectWhole(outcome, sent);
  }
}

TEST_F(HapticClient, IsTheSameDrillEachTimeInLockstep) {
  std::vector<std::vector<Vec3>> runs(2);
  for (auto& sent : runs) {
    VirtualDevice device(handOf(haptics::Holding::Trembling), {});
    ClientSetup setup = setupAt(server_.port());
    setup.on_tick = [keep = keepSent(sent)](const Tick& tick, double) {
      keep(tick);
      return tick.sent < 500;
    };
    const auto client = Client::start(setup, device).value();
    ASSERT_TRUE(waitUntil([&] { return !client->isRunning(); }));
    EXPECT_EQ(client->finish().value().tally.sent, 500u);
  }
  EXPECT_EQ(runs[0], runs[1]);
}

TEST_F(HapticClient, ResumesALineThatBreaksByItsTokenAndLosesNothing) {
  for (const Pace pace : {Pace::Lockstep, Pace::Real}) {
    Relay relay(server_.port());
    VirtualDevice device(handOf(haptics::Holding::Tense), {});
    ClientSetup setup = setupAt(relay.port(), pace);
    std::vector<Vec3> sent;
    setup.on_tick = [&, keep = keepSent(sent)](const Tick& tick, double) {
      keep(tick);
      return tick.sent < 1500;
    };
    std::uint32_t cuts = 0;
    setup.on_answer = [&](const Answered& answered) {
      if (answered.answer.feedback.seq / 400 <= cuts) return;
      ++cuts;
      relay.cut();
    };
    const auto client = Client::start(setup, device).value();
    ASSERT_TRUE(waitUntil([&] { return !client->isRunning(); }));
    const Outcome outcome = client->finish().value();
    EXPECT_GE(outcome.tally.resumed, 1u);
    EXPECT_LE(outcome.tally.resumed, cuts);
    expectWhole(outcome, sent);
  }
}

TEST_F(HapticClient, GivesNoEnergyOverALateNetwork) {
  Relay relay(server_.port(), milliseconds(10));
  VirtualDevice device(handOf(haptics::Holding::Leaning), {});
  ClientSetup setup = setupAt(relay.port(), Pace::Real);
  std::vector<Vec3> sent;
  double strongest_N = 0, longest_mm = 0;
  setup.on_tick = [&, keep = keepSent(sent), before = Vec3{0, 0, -0.5}](const Tick& tick, double) mutable {
    keep(tick);
    longest_mm = std::max(longest_mm, norm(tick.hand.tip_mm - before)), before = tick.hand.tip_mm;
    strongest_N = std::max(strongest_N, norm(tick.felt.force_N));
    return tick.sent < 1500;
  };
  const auto client = Client::start(setup, device).value();
  ASSERT_TRUE(waitUntil([&] { return !client->isRunning(); }));
  const Outcome outcome = client->finish().value();
  // As in device_loop_test: at most one tick's way at the strongest force, until the guard has it back.
  EXPECT_LE(outcome.tally.most_given_mJ, strongest_N * longest_mm);
  EXPECT_LE(outcome.tally.given_mJ, 0);
  EXPECT_GT(outcome.tally.peak_N, 1);
  const std::vector<std::uint32_t> round_trips = client->roundTrips_us();
  ASSERT_FALSE(round_trips.empty());
  EXPECT_GE(round_trips.front(), 20'000u) << "there and back";
  expectWhole(outcome, sent);
}

TEST_F(HapticClient, LetsGoWhenTheServerFreezesAndTakesTheDrillUpWhenItIsBack) {
  VirtualDevice device(handOf(haptics::Holding::Leaning), {});
  ClientSetup setup = setupAt(server_.port(), Pace::Real);
  std::vector<Vec3> sent;
  setup.on_tick = [keep = keepSent(sent)](const Tick& tick, double) {
    keep(tick);
    return true;
  };
  const auto client = Client::start(setup, device).value();
  ASSERT_TRUE(waitUntil([&] { return client->tally().depth_mm > 0.2; }));
  ::kill(server_.id(), SIGSTOP);
  ASSERT_TRUE(waitUntil([&] { return client->tally().phase == Phase::LetGo; }));
  const std::uint32_t sent_then = client->tally().sent;
  const std::uint64_t ticks_then = client->tally().ticks;
  ASSERT_TRUE(waitUntil([&] { return client->tally().ticks > ticks_then + 100; }));
  EXPECT_EQ(client->tally().sent, sent_then) << "nobody feels it, so nothing is drilled";
  ::kill(server_.id(), SIGCONT);
  ASSERT_TRUE(waitUntil([&] { return client->tally().sent > sent_then + 100; }));
  const Outcome outcome = client->finish().value();
  EXPECT_GE(outcome.tally.let_go, 1u);
  expectWhole(outcome, sent);
}

TEST_F(HapticClient, KeepsToTheDevicesForceAndTellsHowOftenItWasLimited) {
  ScriptedDevice device;  // one that reaches 40 mm into the bone at once, whatever it feels
  device.course = [](double t) { return Vec3{0, 0, t < 0.1 ? -0.5 : 40.0}; };
  device.traits.max_force_N = 2, device.traits.damping_N_s_mm = 0.001;
  ClientSetup setup = setupAt(server_.port());
  std::uint64_t limited = 0, told = 0;
  double most_N = 0;
  setup.on_tick = [&](const Tick& tick, double) {
    limited += tick.felt.limited ? 1 : 0;
    most_N = std::max(most_N, norm(device.force_N));
    return tick.sent < 300;
  };
  setup.on_answer = [&](const Answered& answered) { told += answered.answer.feedback.limited ? 1 : 0; };
  const auto client = Client::start(setup, device).value();
  EXPECT_DOUBLE_EQ(client->welcome().stiffness_N_mm, 1.5) << "three quarters of 2 b / T";
  EXPECT_DOUBLE_EQ(client->welcome().force_scale, 2.0 / 40);
  ASSERT_TRUE(waitUntil([&] { return !client->isRunning(); }));
  const Tally tally = client->finish().value().tally;
  EXPECT_GT(tally.limited, 0u);
  EXPECT_EQ(tally.limited, limited);
  EXPECT_GT(told, 0u) << "the server says the same of its own";
  EXPECT_LE(most_N, 2 * (1 + 1e-12));
  EXPECT_DOUBLE_EQ(tally.peak_N, most_N);
}

TEST_F(HapticClient, EndsWithTheDeviceAndStillCompletesTheRecording) {
  ScriptedDevice device;
  device.course = [](double t) { return Vec3{0, 0, -0.5 + 2 * t}; };
  device.fail_at_us = 600'000;
  ClientSetup setup = setupAt(server_.port());
  const auto client = Client::start(setup, device).value();
  ASSERT_TRUE(waitUntil([&] { return !client->isRunning(); }));
  const Outcome outcome = client->finish().value();
  EXPECT_EQ(outcome.device_error, "somebody pulled the plug");
  EXPECT_EQ(device.force_N, Vec3{});
  EXPECT_EQ(device.closed, 1);
  EXPECT_TRUE(recordingOf(outcome.recording_id).complete);
  EXPECT_GT(nlohmann::json::parse(outcome.metrics_json)["removed"], 0);
}

TEST_F(HapticClient, SaysWhatIsWrongInOneLineAndClosesTheDevice) {
  ScriptedDevice device;
  device.course = [](double) { return Vec3{0, 0, -1}; };
  const auto messageOf = [&](const ClientSetup& setup) {
    const auto client = Client::start(setup, device);
    EXPECT_FALSE(client.has_value());
    return client ? std::string() : client.error().message;
  };
  ClientSetup setup = setupAt(server_.port());
  setup.case_id = "czzzzzzz";
  EXPECT_EQ(messageOf(setup), "there is no case czzzzzzz");
  setup.case_id = "../cases";
  EXPECT_EQ(messageOf(setup), "there is no case ../cases");
  setup = setupAt(server_.port());
  setup.path_id = "pzzzzzzz";
  EXPECT_EQ(messageOf(setup), "there is no path pzzzzzzz in case " + small_.case_id);
  EXPECT_EQ(device.closed, 0) << "it was never opened";
  device.traits.rate_hz = 1e6;
  EXPECT_EQ(messageOf(setupAt(server_.port())), "device '': its rate (50 to 4000 Hz) is out of range");
  EXPECT_EQ(device.closed, 1);
}

TEST_F(HapticClient, GivesUpOnAServerThatIsGoneForGood) {
  ScriptedDevice device;
  device.course = [](double t) { return Vec3{0, 0, -0.5 + 0.2 * t}; };
  ClientSetup setup = setupAt(server_.port(), Pace::Real);
  setup.resume_for = milliseconds(300);
  const auto client = Client::start(setup, device).value();
  ASSERT_TRUE(waitUntil([&] { return client->tally().phase == Phase::Holding; }));
  server_.end(SIGKILL);
  ASSERT_TRUE(waitUntil([&] { return !client->isRunning(); }));
  EXPECT_EQ(device.closed, 1);
  const auto outcome = client->finish();
  ASSERT_FALSE(outcome.has_value());
  EXPECT_EQ(outcome.error().message.rfind("the line broke and could not be resumed: no server at 127.0.0.1:", 0), 0u)
      << outcome.error().message;
}

TEST_F(HapticClient, LeavesASessionThatItDidNotFinishToTheServer) {
  ScriptedDevice device;
  device.course = [](double t) { return Vec3{0, 0, -0.5 + 2 * t}; };
  {
    const auto client = Client::start(setupAt(server_.port()), device).value();
    ASSERT_TRUE(waitUntil([&] { return client->tally().sent > 200; }));
  }
  EXPECT_EQ(device.closed, 1);
  EXPECT_EQ(server_.end(), 0);
  const auto rows = store_.recordings(small_.case_id).value();
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_FALSE(rows[0].complete);
}

}  // namespace
}  // namespace spinaltap::haptic_client
