#include "core/session/session.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "core/base/random.h"
#include "core/session/scenes.h"

namespace spinaltap::session {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

Session makeSession(const std::string& engine = "clearance", int discs = 40) {
  auto session = Session::create(*sceneVolume(discs), {reportBit(), engine});
  EXPECT_TRUE(session.has_value());
  return std::move(*session);
}

Input pose(std::uint64_t t_us, double z_mm) {
  Input input;
  input.t_us = t_us;
  input.tip_mm = {0, 0, z_mm};
  return input;
}

TEST(Session, CountsWhatItRemovesAndFeelsTheNextFeed) {
  Session session = makeSession();
  const std::uint64_t before = point_volume::countAlive(session.volume());
  Output output = session.step(pose(5000, 0.5));
  EXPECT_EQ(output.status, Status::Ok);
  EXPECT_EQ(output.cycle, 1u);
  EXPECT_GT(output.removed, 0u);
  EXPECT_EQ(output.depth_mm, 0.5);
  EXPECT_EQ(output.thrust_N, 0.0);  // the first cycle lasts no time
  output = session.step(pose(6000, 0.6));
  EXPECT_GT(output.thrust_N, 0.0);
  EXPECT_EQ(before - output.removed_total, point_volume::countAlive(session.volume()));
  EXPECT_EQ(output.state_hash, session.stateHash());
}

TEST(Session, AsksOfARigidHoldWhatTheLawSaysOfItsFeed) {
  // 3 mm at 1 mm/s and 1000 rpm through 300 mg/cm3, from the reference drilling (haptics/constants.h) by hand:
  // (300/1850)^2 * (129.5 N * (3/3.2)^2 + 562 N/mm * 3/3.2 * 0.06 mm) = 3.82 N, whose constants have three digits.
  Session session = makeSession("clearance", 200);
  double sum = 0;
  int count = 0;
  for (int i = 0; i < 15000; ++i) {
    const Output output = session.step(pose(static_cast<std::uint64_t>(i) * 1000, 0.001 * i));
    if (i >= 8000) sum += output.thrust_N, ++count;
  }
  EXPECT_NEAR(sum / count, 3.82, 0.02);
}

TEST(Session, OnTheReportsVolumeTakesNoMoreThanTwoPointTwoBytesAPoint) {
  // 16 bits of density and one alive bit are 2.125; the tables that make a cycle cheap get the rest. Each structure is
  // counted with the memory it holds; the engine beside the session is made as the session makes its own.
  const Session session = makeSession("clearance", reportLattice().discs);
  const auto engine = drill::makeEngine("clearance", session.volume(), reportBit());
  ASSERT_TRUE(engine.has_value());
  const auto points = static_cast<double>(reportLattice().points());
  const std::size_t bytes = session.volume().bytes() + (*engine)->bytes() + sizeof(Session);
  EXPECT_EQ(reportLattice().points(), 986958u);
  EXPECT_LE(static_cast<double>(bytes) / points, 2.2) << bytes << " bytes";
  EXPECT_GT(static_cast<double>(bytes) / points, 2.125) << "else something is not counted";
}

TEST(Session, RemovesNothingWithABitThatDoesNotTurn) {
  Session session = makeSession();
  Input input = pose(0, 3);
  input.spinning = false;
  const Output output = session.step(input);
  EXPECT_EQ(output.status, Status::Ok);
  EXPECT_EQ(output.cycle, 1u);
  EXPECT_EQ(output.removed, 0u);
  EXPECT_EQ(point_volume::countAlive(session.volume()), session.volume().lattice.points());
}

TEST(Session, NormalisesTheAxisSoThatItsLengthDoesNotMatter) {
  Session a = makeSession(), b = makeSession();
  Input input = pose(0, 2);
  input.axis = {0, 0.6, 0.8};
  const Output first = a.step(input);
  input.axis = {0, 0.6 * 4096, 0.8 * 4096};  // a power of two: the same bits after the division
  EXPECT_EQ(b.step(input).state_hash, first.state_hash);
  EXPECT_GT(first.removed, 0u);
}

void expectRefused(Session& session, const Input& input, Status status) {
  const std::vector<std::uint64_t> alive = session.volume().alive;
  const std::uint64_t hash = session.stateHash();
  const Output output = session.step(input);
  EXPECT_EQ(output.status, status);
  EXPECT_EQ(output.thrust_N, 0.0);
  EXPECT_EQ(output.removed, 0u);
  EXPECT_EQ(output.state_hash, hash);
  EXPECT_EQ(session.stateHash(), hash);
  EXPECT_EQ(session.volume().alive, alive);
}

TEST(Session, RefusesWhatIsNotFiniteOrFarAwayAndIsLeftUntouched) {
  Session session = makeSession();
  ASSERT_EQ(session.step(pose(1000, 1)).status, Status::Ok);
  ASSERT_EQ(session.step(pose(2000, 1.1)).status, Status::Ok);
  for (const double v : {kNan, kInf, -kInf}) {
    for (int field = 0; field < 6; ++field) {
      Input input = pose(3000, 2);
      double* fields[] = {&input.tip_mm.x, &input.tip_mm.y, &input.tip_mm.z,
                          &input.axis.x,   &input.axis.y,   &input.axis.z};
      *fields[field] = v;
      expectRefused(session, input, Status::RefusedNotFinite);
    }
  }
  for (const double v : {1.0000001e6, -1.0000001e6, 1e300, -1.7e308}) {
    Input input = pose(3000, 2);
    input.tip_mm.x = v;
    expectRefused(session, input, Status::RefusedNotFinite);
  }
  EXPECT_EQ(session.step(pose(3000, 1.2)).cycle, 3u);
}

TEST(Session, RefusesAnAxisWithoutDirectionAndTimeThatFalls) {
  Session session = makeSession();
  ASSERT_EQ(session.step(pose(5000, 1)).status, Status::Ok);
  for (const Vec3& axis : {Vec3{0, 0, 0}, Vec3{0, 0, 9e-7}, Vec3{5e-324, 0, 5e-324}, Vec3{0, 0, 1.1e6},
                           Vec3{1e308, 1e308, 1e308}, Vec3{-0.0, -0.0, -0.0}}) {
    Input input = pose(6000, 2);
    input.axis = axis;
    expectRefused(session, input, Status::RefusedAxis);
  }
  expectRefused(session, pose(4999, 2), Status::RefusedTime);
  EXPECT_EQ(session.step(pose(5000, 2)).status, Status::Ok);  // equal times are no fall
}

TEST(Session, AcceptsTheLimitsThemselves) {
  Session session = makeSession();
  Input input = pose(0, 1);
  input.tip_mm = {1e6, -1e6, 1e6};
  input.axis = {1e6, 0, 0};
  EXPECT_EQ(session.step(input).status, Status::Ok);
  input = pose(std::numeric_limits<std::uint64_t>::max(), 1);
  input.axis = {0, 0, 1e-6};
  EXPECT_EQ(session.step(input).status, Status::Ok);
  EXPECT_EQ(session.step(pose(0, 1)).status, Status::RefusedTime);
}

/// Bits as a hostile client would send them, often close to what is accepted.
double anyBits(Random& random) {
  static const double kSpecial[] = {0.0,   -0.0, 1.0,  -1.0, 1e-6, 1e6,   -1e6,   1e-310, 5e-324,
                                    1e308, kNan, kInf, 3.0,  0.1,  -kInf, 1.5e-9, 1e154,  -1e154};
  switch (random.below(4)) {
    case 0: {
      const std::uint64_t bits = random.bits();
      double v = 0;
      std::memcpy(&v, &bits, sizeof v);
      return v;
    }
    case 1:
      return kSpecial[random.below(sizeof kSpecial / sizeof kSpecial[0])];
    default:
      return random.uniform(-4, 4);
  }
}

TEST(Session, GivesADefinedAnswerToAnyBitsFromAnyEngine) {
  for (const std::string_view name : drill::engineNames()) {
    Session session = makeSession(std::string(name), 8);
    Random random(99);
    std::uint64_t accepted = 0, removed = 0;
    for (int i = 0; i < 1500; ++i) {
      Input input;
      // Mostly rising; anything once in a while, and never so far ahead that all later ones would be refused.
      const std::uint64_t now = static_cast<std::uint64_t>(i) * 1000;
      input.t_us = random.below(10) == 0 ? random.bits() % (now + 1) : now;
      input.tip_mm.x = anyBits(random), input.tip_mm.y = anyBits(random), input.tip_mm.z = anyBits(random);
      input.axis.x = anyBits(random), input.axis.y = anyBits(random), input.axis.z = anyBits(random);
      input.spinning = random.below(4) != 0;
      const Output output = session.step(input);
      accepted += output.status == Status::Ok;
      removed += output.removed;
      ASSERT_EQ(output.cycle, accepted);
      ASSERT_EQ(output.removed_total, removed);
      ASSERT_TRUE(std::isfinite(output.thrust_N) && output.thrust_N >= 0);
      ASSERT_TRUE(std::isfinite(output.depth_mm));
    }
    EXPECT_GT(accepted, 100u);
    EXPECT_GT(removed, name == "report" ? 0u : 1000u);  // the report's tip must be inside before it cuts
    EXPECT_EQ(session.volume().lattice.points() - point_volume::countAlive(session.volume()), removed);
  }
}

TEST(Session, CutsAFarThrowInTheCyclesThatFollowAndLosesNothingOfIt) {
  Session thrown = makeSession("clearance", 200), slow = makeSession("clearance", 200);
  // 15 mm in a millisecond is 300 cuts of half a spacing, 64 of them a cycle.
  Output output = thrown.step(pose(0, -1));
  output = thrown.step(pose(1000, 14));
  EXPECT_EQ(output.status, Status::Ok);
  EXPECT_TRUE(output.behind);
  EXPECT_EQ(output.depth_mm, 14);  // where the hand is
  int cycles = 1;
  for (std::uint64_t t = 2000; output.behind; t += 1000, ++cycles) output = thrown.step(pose(t, 14));
  EXPECT_EQ(cycles, 5);
  for (int i = 0; i <= 1500; ++i) output = slow.step(pose(static_cast<std::uint64_t>(i) * 1000, -1 + 0.01 * i));
  EXPECT_FALSE(output.behind);
  EXPECT_EQ(thrown.volume().alive, slow.volume().alive);
}

TEST(Session, TakesEveryPoseHoweverFastTheyCome) {
  Session session = makeSession();
  std::uint64_t t = 0;
  Output output;
  for (; t < 1500; ++t) {  // to and fro through the volume, all the time: 120 cuts a pose
    output = session.step(pose(t, t % 2 == 0 ? -1 : 5));
    ASSERT_EQ(output.status, Status::Ok);
    ASSERT_EQ(output.cycle, t + 1);
  }
  EXPECT_TRUE(output.behind);
  int cycles = 0;
  for (; output.behind; ++cycles) output = session.step(pose(t++, 5));
  EXPECT_GT(cycles, 20);
  EXPECT_LE(cycles, static_cast<int>(drill::Sweep::kMostPoses) * 120 /
                        kMostCuts);  // as many as wait, with as many cuts as a pose has
}

TEST(Session, GoesOnAlikeAfterItIsMoved) {
  Session stays = makeSession();
  Session first = makeSession();
  (void)stays.step(pose(0, 1));
  (void)first.step(pose(0, 1));
  const std::uint64_t* address = first.volume().alive.data();
  Session second = std::move(first);
  EXPECT_EQ(second.volume().alive.data(), address);
  EXPECT_EQ(second.step(pose(1000, 2)).state_hash, stays.step(pose(1000, 2)).state_hash);
}

TEST(Session, HashesEverythingThatItPromises) {
  Session a = makeSession(), b = makeSession();
  const std::uint64_t fresh = a.stateHash();
  (void)a.step(pose(0, -30));  // touches nothing, but is a cycle
  EXPECT_NE(a.stateHash(), fresh);
  (void)b.step(pose(1, -30));  // the same at another time
  EXPECT_NE(a.stateHash(), b.stateHash());
}

TEST(Session, RefusesABrokenVolumeABrokenBitAndAnUnknownEngine) {
  EXPECT_EQ(Session::create(*sceneVolume(2), {reportBit(), "steam"}).error().code, ErrorCode::NotFound);
  EXPECT_EQ(Session::create(*sceneVolume(2), {{9, 5, 50}, "bounded"}).error().code, ErrorCode::InvalidArgument);
  auto volume = *sceneVolume(2);
  volume.alive.pop_back();
  EXPECT_EQ(Session::create(volume, {}).error().code, ErrorCode::InvalidArgument);
  volume = *sceneVolume(2);
  volume.density_mg_cm3.push_back(1);
  EXPECT_EQ(Session::create(volume, {}).error().code, ErrorCode::InvalidArgument);
  volume = *sceneVolume(2);
  volume.alive.back() |= std::uint64_t{1} << 63;
  EXPECT_EQ(Session::create(volume, {}).error().code, ErrorCode::InvalidArgument);
  volume = *sceneVolume(2);
  volume.lattice.rings = -1;
  EXPECT_EQ(Session::create(volume, {}).error().code, ErrorCode::InvalidArgument);
}

}  // namespace
}  // namespace spinaltap::session
