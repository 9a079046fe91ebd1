#include "core/wire/drill_messages.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "core/base/random.h"
#include "tests/core/wire/golden.h"

namespace spinaltap::wire {
namespace {

using Bytes = std::vector<std::byte>;

template <class Variant, class Decode>
void expectRoundTrip(const std::string& name, Decode decode) {
  const Bytes& bytes = golden().at(name);
  ASSERT_FALSE(bytes.empty());
  const auto message = decode(bytes);
  ASSERT_TRUE(message.has_value()) << name << ": " << message.error().message;
  EXPECT_EQ(encode(Variant(*message)), bytes) << name;
}

double nanWithPayload(std::uint64_t payload) {
  const std::uint64_t bits = 0x7ff8000000000000ull | payload;
  double v = 0;
  std::memcpy(&v, &bits, sizeof v);
  return v;
}

TEST(DrillMessages, EveryGoldenMessageDecodesAndEncodesToTheSameBytes) {
  for (const char* name : {"hello", "hello_resume", "hello_watch", "poses", "finish"})
    expectRoundTrip<ClientMessage>(name, decodeClientMessage);
  for (const char* name : {"welcome", "feedback", "finished", "refused", "status"}) {
    expectRoundTrip<ServerMessage>(name, decodeServerMessage);
  }
}

constexpr Token kToken{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};

TEST(DrillMessages, TheGoldenFieldsOfTheClientAreThoseThatTheContractNames) {
  EXPECT_EQ(std::get<Hello>(*decodeClientMessage(golden().at("hello"))),
            (Hello{Role::Drive, false, false, 1000, 3.3, 2, 0.005, 1000, {}}));
  EXPECT_EQ(std::get<Hello>(*decodeClientMessage(golden().at("hello_resume"))),
            (Hello{Role::Drive, true, true, 0, 0, 0, 0, 0, kToken}));
  EXPECT_EQ(std::get<Hello>(*decodeClientMessage(golden().at("hello_watch"))),
            (Hello{Role::Watch, false, false, 60, 0, 0, 0, 0, {}}));

  const Poses poses = std::get<Poses>(*decodeClientMessage(golden().at("poses")));
  EXPECT_EQ(poses.first_seq, 42u);
  ASSERT_EQ(poses.poses.size(), 2u);
  EXPECT_EQ(poses.poses[0], (session::Input{1000, {0.5, -0.25, 10}, {0, 0, 1}, true}));
  EXPECT_EQ(poses.poses[1].t_us, 2000u);
  const double nan = nanWithPayload(1);
  EXPECT_EQ(std::memcmp(&poses.poses[1].tip_mm.x, &nan, sizeof nan), 0) << "all 64 bits arrive, NaN payload included";
  EXPECT_EQ(poses.poses[1].tip_mm.y, std::numeric_limits<double>::infinity());
  EXPECT_TRUE(std::signbit(poses.poses[1].tip_mm.z));
  EXPECT_FALSE(poses.poses[1].spinning);
}

TEST(DrillMessages, TheGoldenFieldsOfTheServerAreThoseThatTheContractNames) {
  const Welcome welcome = std::get<Welcome>(*decodeServerMessage(golden().at("welcome")));
  EXPECT_TRUE(welcome.realtime);
  EXPECT_EQ(welcome.state_hash, 0x0123456789abcdefull);
  EXPECT_EQ(welcome.points_alive, 986958u);
  EXPECT_EQ(welcome.token, kToken);
  EXPECT_EQ(welcome.next_seq, 43u);
  EXPECT_EQ(welcome.stiffness_N_mm, 2);
  EXPECT_EQ(welcome.damping_N_s_mm, 0.001);
  EXPECT_EQ(welcome.force_scale, 0.0825);
  EXPECT_EQ(welcome.hash_every, 16u);

  const Feedback feedback = std::get<Feedback>(*decodeServerMessage(golden().at("feedback")));
  EXPECT_EQ(feedback.seq, 43u);
  EXPECT_EQ(feedback.t_us, 2000u);
  EXPECT_EQ(feedback.status, session::Status::RefusedNotFinite);
  EXPECT_TRUE(feedback.behind && feedback.limited && feedback.has_hash);
  EXPECT_EQ(feedback.cycle, 1001u);
  EXPECT_EQ(feedback.removed_total, 12345u);
  EXPECT_EQ(feedback.force_N, (Vec3{0.25, -0.5, -3.25}));
  EXPECT_EQ(feedback.torque_Nmm, (Vec3{1.5, -2, -18}));
  EXPECT_EQ(feedback.force_patient_N, (Vec3{-0.5, 0.25, 3.25}));
  EXPECT_EQ(feedback.tip_mm, (Vec3{0.125, -0.0625, -0.125}));
  EXPECT_EQ(feedback.axis, (Vec3{0, 0.6, 0.8}));
  EXPECT_EQ(feedback.depth_mm, -0.125);
  EXPECT_EQ(feedback.thrust_N, 4.5);
  EXPECT_EQ(feedback.local.bit.tip_mm, feedback.tip_mm);
  EXPECT_EQ(feedback.local.frontal_mm2, (std::array<float, 5>{1, 1.5F, 2, 2.5F, 3}));
  EXPECT_EQ(feedback.local.rubbing_mm2, 12.5F);
  EXPECT_EQ(feedback.local.side_mm2[7], 3.5F);
  EXPECT_EQ(feedback.local.side_lever[7], 0.875F);
  EXPECT_EQ(feedback.state_hash, 0xfedcba9876543210ull);

  const Finished finished = std::get<Finished>(*decodeServerMessage(golden().at("finished")));
  EXPECT_EQ(finished.recording_id, "r7k2m9xq");
  EXPECT_EQ(finished.metrics_json, "{\"peak_thrust_N\":4.5}");
  EXPECT_EQ(std::get<Refused>(*decodeServerMessage(golden().at("refused"))).reason, "no such session");
  const SessionStatus status = std::get<SessionStatus>(*decodeServerMessage(golden().at("status")));
  EXPECT_EQ(status.code, StatusCode::Paused);
  EXPECT_EQ(status.text, "the trainee is away");
}

TEST(DrillMessages, WithoutItsFlagAHashIsNotSent) {
  Feedback feedback;
  feedback.state_hash = 99;
  EXPECT_EQ(std::get<Feedback>(*decodeServerMessage(encode(ServerMessage(feedback)))).state_hash, 0u);
}

TEST(DrillMessages, PosesReadIntoABatchThatIsThereAreTheSame) {
  Poses batch;
  batch.poses.resize(7);
  ASSERT_TRUE(decodePoses(golden().at("poses"), batch).has_value());
  EXPECT_EQ(encode(ClientMessage(batch)), golden().at("poses"));
  for (const auto& [name, bytes] : golden()) {
    EXPECT_EQ(decodePoses(bytes, batch).has_value(), name == "poses") << name;
  }
}

TEST(DrillMessages, EveryBadGoldenMessageIsRefusedWithOneLine) {
  int bad = 0;
  for (const auto& [name, bytes] : golden()) {
    if (name.rfind("bad_", 0) != 0) continue;
    ++bad;
    for (const auto& error :
         {decodeClientMessage(bytes).map([](auto&&) {}), decodeServerMessage(bytes).map([](auto&&) {})}) {
      ASSERT_FALSE(error.has_value()) << name;
      EXPECT_EQ(error.error().message.find('\n'), std::string::npos);
      EXPECT_FALSE(error.error().message.empty());
    }
  }
  EXPECT_EQ(bad, 20);
  EXPECT_EQ(decodeClientMessage(golden().at("bad_version")).error().code, ErrorCode::Unsupported);
  EXPECT_EQ(decodeClientMessage(golden().at("bad_version_1")).error().message,
            "drill message: protocol version 1 is no longer spoken, this side speaks 2");
  EXPECT_EQ(decodeClientMessage(golden().at("bad_hello_nan")).error().message,
            "drill message: hello: the maximum force is no number from 0 on at byte 52");
  EXPECT_EQ(decodeClientMessage(golden().at("bad_flags")).error().message, "drill message: reserved flags at byte 64");
}

TEST(DrillMessages, AMessageCutAnywhereOrWithAByteTooManyIsRefused) {
  for (const auto& [name, bytes] : golden()) {
    if (name.rfind("bad_", 0) == 0) continue;
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      const std::span<const std::byte> cut(bytes.data(), size);
      EXPECT_FALSE(decodeClientMessage(cut).has_value()) << name << " cut at " << size;
      EXPECT_FALSE(decodeServerMessage(cut).has_value()) << name << " cut at " << size;
    }
    Bytes longer = bytes;
    longer.push_back(std::byte{0});
    EXPECT_FALSE(decodeClientMessage(longer).has_value()) << name;
    EXPECT_FALSE(decodeServerMessage(longer).has_value()) << name;
  }
}

TEST(DrillMessages, NeitherSideTakesTheOthersMessages) {
  for (const char* name : {"welcome", "feedback", "finished", "refused", "status"}) {
    EXPECT_FALSE(decodeClientMessage(golden().at(name)).has_value()) << name;
  }
  for (const char* name : {"hello", "hello_resume", "hello_watch", "poses", "finish"}) {
    EXPECT_FALSE(decodeServerMessage(golden().at(name)).has_value()) << name;
  }
}

TEST(DrillMessages, RandomBytesAndMutatedMessagesGiveAMessageThatEncodesBackOrAnError) {
  Random random(20020402);
  int accepted = 0;
  std::vector<Bytes> seeds;
  for (const auto& [name, bytes] : golden()) seeds.push_back(bytes);
  for (int i = 0; i < 200000; ++i) {
    Bytes bytes = seeds[random.below(seeds.size())];
    for (std::uint64_t n = random.below(4); n > 0; --n) {
      bytes[random.below(bytes.size())] = static_cast<std::byte>(random.bits());
    }
    if (random.below(3) == 0) bytes.resize(random.below(80));
    if (const auto message = decodeClientMessage(bytes)) {
      ++accepted;
      ASSERT_EQ(encode(ClientMessage(*message)), bytes);
    }
    if (const auto message = decodeServerMessage(bytes)) {
      ++accepted;
      ASSERT_EQ(encode(ServerMessage(*message)), bytes);
    }
  }
  EXPECT_GT(accepted, 10000) << "the mutations must leave some messages alive for this to test anything";
}

TEST(DrillMessages, AFullBatchRoundTripsAndALargerOneIsRefused) {
  Random random(7);
  Poses poses;
  for (std::size_t i = 0; i < kMaxPosesPerBatch; ++i) {
    session::Input pose{random.bits(), {}, {}, random.below(2) == 1};
    for (double* v : {&pose.tip_mm.x, &pose.tip_mm.y, &pose.tip_mm.z, &pose.axis.x, &pose.axis.y, &pose.axis.z}) {
      *v = random.uniform(-100, 100);
    }
    poses.poses.push_back(pose);
  }
  Bytes bytes = encode(ClientMessage(poses));
  EXPECT_EQ(bytes.size(), kMaxClientMessageBytes);
  EXPECT_EQ(std::get<Poses>(*decodeClientMessage(bytes)).poses, poses.poses);
  bytes[6] = std::byte{1};  // 4097
  bytes.resize(bytes.size() + kBytesPerPose);
  EXPECT_FALSE(decodeClientMessage(bytes).has_value());
}

TEST(DrillMessages, ATextOverItsBoundIsCutSoThatItIsStillAMessage) {
  const Bytes bytes = encode(ServerMessage(Refused{std::string(kMaxReasonBytes + 10, 'x')}));
  EXPECT_EQ(std::get<Refused>(*decodeServerMessage(bytes)).reason.size(), kMaxReasonBytes);
}

}  // namespace
}  // namespace spinaltap::wire
