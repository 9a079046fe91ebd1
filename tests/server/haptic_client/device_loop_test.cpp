// A device's loop without sockets: the session is in this process, and answers when the test lets it.
#include "server/haptic_client/device_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

#include "core/session/session.h"
#include "tests/server/haptic_client/hands.h"

namespace spinaltap::haptic_client {
namespace {
using test::ScriptedDevice;

constexpr std::uint64_t kPeriod_us = 1000;

/// Cancellous bone from z = 0 on.
session::Session makeSession(const haptics::Coupling& coupling) {
  const point_volume::Lattice lattice{0.2, 12, 60, 0};
  session::Config config{plan::Bit{3, 5, 40}};
  config.coupling = coupling;
  return session::Session::create(*point_volume::solidVolume(lattice, 250), config).value();
}

/// A network that takes `delay` ticks there and back, and may fall silent.
class FakeLink final : public Link {
 public:
  FakeLink(session::Session& session, std::size_t delay) : session_(session), delay_(delay) {}

  void send(std::uint32_t seq, const session::Input& pose) override {
    inputs.push_back(pose);
    const session::Output output = session_.step(pose);
    EXPECT_EQ(output.status, session::Status::Ok);
    Answer answer;
    wire::Feedback& f = answer.feedback;
    f.seq = seq, f.t_us = pose.t_us, f.cycle = output.cycle, f.removed_total = output.removed_total;
    f.force_N = output.force_N, f.tip_mm = output.bit.tip_mm, f.axis = output.bit.axis;
    f.depth_mm = output.depth_mm, f.thrust_N = output.thrust_N, f.local = session_.localModel();
    waiting_.push_back({now + delay_, answer});
  }
  bool take(Answer& into) override {
    if (silent || waiting_.empty() || waiting_.front().due > now) return false;
    into = waiting_.front().answer;
    waiting_.pop_front();
    return true;
  }
  [[nodiscard]] std::uint32_t resumed() const override { return resumes; }
  /// The line broke and is back: what was taken is not answered any more.
  void breakAndResume() { waiting_.clear(), ++resumes; }

  std::vector<session::Input> inputs;
  std::size_t now = 0;  ///< ticks
  bool silent = false;
  std::uint32_t resumes = 0;

 private:
  struct Waiting {
    std::size_t due;
    Answer answer;
  };
  session::Session& session_;
  std::size_t delay_;
  std::deque<Waiting> waiting_;
};

LoopSetup setupOf(const DeviceTraits& traits, double stiffness = 5, double scale = 1) {
  wire::Welcome welcome;
  welcome.stiffness_N_mm = stiffness, welcome.force_scale = scale;
  return setupFrom(welcome, traits, 3);
}

/// Everything together, ticked from outside.
struct Bench {
  explicit Bench(Device& device, const DeviceTraits& traits, std::size_t delay = 0, double scale = 1)
      : session(makeSession({5, 0})),
        link(session, delay),
        loop(device, link, setupOf(traits, 5, scale), [this](const Answered& a) { answers.push_back(a.answer); }) {}
  Result<Tick> tick() {
    ++link.now;
    return loop.tick(link.now * kPeriod_us);
  }
  Tick run(int ticks) {
    Tick last;
    for (int i = 0; i < ticks; ++i) last = tick().value();
    return last;
  }
  session::Session session;
  FakeLink link;
  std::vector<Answer> answers;
  DeviceLoop loop;
};

TEST(DeviceLoop, SendsOnePoseAndWaitsForItsAnswerBeforeAnythingIsFelt) {
  ScriptedDevice device;
  device.course = [](double) { return Vec3{0, 0, -1}; };
  Bench bench(device, device.traits, 7);
  const Tick before = bench.run(7);
  EXPECT_EQ(before.phase, Phase::Greeting);
  EXPECT_EQ(bench.link.inputs.size(), 1u);
  EXPECT_FALSE(device.held);
  EXPECT_EQ(bench.run(2).phase, Phase::Holding);
  EXPECT_TRUE(device.held);
  EXPECT_GT(bench.link.inputs.size(), 1u);
}

TEST(DeviceLoop, GivesNoEnergyToAnyHandUnderAnyDelay) {
  for (const haptics::Holding holding : haptics::kHoldings) {
    for (const std::size_t delay : {0, 5, 20, 50}) {
      VirtualHand hand;
      hand.holding = holding;
      DeviceTraits traits;
      VirtualDevice device(hand, traits);
      traits = device.open().value();
      Bench bench(device, traits, delay);
      bench.run(2500);
      EXPECT_EQ(bench.loop.timesLetGo(), 0u);
      EXPECT_GT(bench.loop.depth_mm(), 0.5);
      // Whoever drills pays first, and the guard sees to it later. Rounding: 2500 products of at most 100 N and 5 mm.
      EXPECT_LE(bench.loop.guard().mostGiven_mJ(), 2500 * 500 * 2.3e-16)
          << haptics::nameOf(holding) << " " << delay << " ms";
      EXPECT_LT(bench.loop.guard().given_mJ(), -0.1) << "bone was cut";
    }
  }
}

TEST(DeviceLoop, LetsGoOfADrillWhoseAnswersStayAwayAndTakesItUpWhereItStands) {
  ScriptedDevice device;
  double ahead_mm = 1.0;
  device.course = [&](double t) { return Vec3{0.1, 0, std::min(-0.5 + 2 * t, ahead_mm)}; };
  Bench bench(device, device.traits);
  bench.run(1200);
  const double depth = bench.loop.depth_mm();
  const std::uint64_t removed = bench.answers.back().feedback.removed_total;
  EXPECT_GT(depth, 0.5);

  bench.link.silent = true;
  bench.run(240);
  EXPECT_EQ(bench.loop.timesLetGo(), 0u) << "not yet 0.25 s";
  bench.run(11 + 50);
  EXPECT_EQ(bench.loop.timesLetGo(), 1u);
  EXPECT_FALSE(device.held);
  const std::size_t sent = bench.link.inputs.size();
  ahead_mm = 100;  // the hand falls forward, and turns
  device.axis = {0.1, 0, 1};
  const Tick gone = bench.run(3000);
  EXPECT_EQ(gone.felt.force_N, Vec3{}) << "faded";
  EXPECT_EQ(bench.link.inputs.size(), sent) << "what nobody feels is not drilled";

  bench.link.silent = false;
  const Tick back = bench.run(3);
  EXPECT_EQ(back.phase, Phase::Holding);
  EXPECT_TRUE(device.held);
  EXPECT_NEAR(norm(back.felt.force_N), 0, 5 * 2 * 0.004) << "5 N/mm at rest, but for the feed of these ticks";
  for (std::size_t i = sent; i < bench.link.inputs.size(); ++i) {
    // One or two ticks of 2 mm/s past where the bit stood when it was let go; in 0.25 s without answers it went on by
    // at most what its spring held, less than 2 mm of feed and pull.
    EXPECT_NEAR(bench.link.inputs[i].tip_mm.z, bench.answers.back().feedback.tip_mm.z, 0.01);
    EXPECT_NEAR(bench.link.inputs[i].axis.x, 0, 1e-9) << "turned back to where the bit points";
  }
  bench.run(200);
  EXPECT_GT(bench.loop.depth_mm(), depth) << "and it goes on";
  EXPECT_GT(bench.answers.back().feedback.removed_total, removed);
  EXPECT_EQ(bench.link.inputs.size(), bench.answers.size() + 1) << "every pose but the last is answered";
}

TEST(DeviceLoop, LetsGoAfterItSleptItself) {
  ScriptedDevice device;
  double fell_mm = 0;
  device.course = [&](double t) { return Vec3{0, 0, -0.5 + 2 * std::min(t, 1.0) + fell_mm}; };
  Bench bench(device, device.traits);
  bench.run(1000);
  const double depth = bench.loop.depth_mm();
  fell_mm = 20;  // while nobody told the motors anything
  bench.link.now += 150;
  bench.run(1);
  EXPECT_EQ(bench.loop.timesLetGo(), 1u);
  EXPECT_EQ(bench.run(5).phase, Phase::Holding);
  bench.run(500);
  EXPECT_NEAR(bench.loop.depth_mm(), depth, 2 * 0.25 + 0.01) << "what the spring held, and not 20 mm";
}

TEST(DeviceLoop, AsksAgainWhenAnswersWereLostWithTheLine) {
  for (const bool greeting : {true, false}) {
    ScriptedDevice device;
    device.course = [](double t) { return Vec3{0, 0, -0.5 + 2 * t}; };
    Bench bench(device, device.traits, 3);
    bench.run(greeting ? 2 : 700);
    bench.link.silent = true;
    bench.run(400);
    bench.link.breakAndResume();
    bench.link.silent = false;
    const Tick tick = bench.run(10);
    EXPECT_EQ(tick.phase, Phase::Holding) << greeting;
    EXPECT_EQ(bench.loop.timesLetGo(), greeting ? 0u : 1u);
  }
}

TEST(DeviceLoop, TellsWhenTheForceIsShortenedToTheDevice) {
  ScriptedDevice device;
  device.course = [](double t) { return Vec3{0, 0, -0.5 + 4 * t}; };
  device.traits.max_force_N = 0.3;
  Bench bench(device, device.traits, 0, 0.5);
  bool limited = false;
  for (int i = 0; i < 1500; ++i) {
    const Tick tick = bench.tick().value();
    EXPECT_LE(norm(device.force_N), 0.3 * (1 + 1e-12));
    EXPECT_EQ(tick.felt.limited, norm(device.force_N) > 0.3 * (1 - 1e-12)) << i;
    limited = limited || tick.felt.limited;
  }
  EXPECT_TRUE(limited);
  EXPECT_GT(bench.answers.back().feedback.thrust_N, 0.6) << "the bone gives twice that and more";
}

TEST(DeviceLoop, PushesNothingOnceTheDeviceFailsOrTellsRubbish) {
  for (const bool rubbish : {false, true}) {
    ScriptedDevice device;
    double nan = 0;
    device.course = [&](double t) { return Vec3{nan, 0, -0.5 + 2 * t}; };
    Bench bench(device, device.traits);
    bench.run(1200);
    EXPECT_GT(norm(device.force_N), 0.3);
    if (rubbish) nan = std::numeric_limits<double>::quiet_NaN();
    if (!rubbish) device.fail_at_us = 0;
    const auto tick = bench.tick();
    ASSERT_FALSE(tick.has_value());
    EXPECT_EQ(device.force_N, Vec3{});
    EXPECT_EQ(tick.error().message, rubbish ? "the device's position is no position" : "somebody pulled the plug");
  }
}

TEST(DeviceLoop, ForgetsNoPoseThatItsBitStillHasToLearnOf) {
  ScriptedDevice device;
  device.course = [](double t) { return Vec3{0, 0, -0.5 + 0.1 * t}; };
  Bench bench(device, device.traits);
  bench.run(5);
  bench.link.silent = true;
  for (int i = 0; i < 3000; ++i) {  // at a rate of a megahertz: 0.25 s are far away
    bench.link.now += 1;
    std::ignore = bench.loop.tick(5 * kPeriod_us + bench.link.now).value();
  }
  EXPECT_EQ(bench.loop.timesLetGo(), 1u);
  EXPECT_LE(bench.link.inputs.size(), bench.answers.size() + DeviceLoop::kMostUnanswered);
}

}  // namespace
}  // namespace spinaltap::haptic_client
