// The protocol of a live drill, on the real loops, over pairs of sockets in this process.
#include "server/ws/drill_hub.h"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <atomic>
#include <chrono>
#include <limits>
#include <memory>
#include <thread>

#include "core/recording/recording.h"
#include "tests/server/sockets.h"
#include "tests/server/temporary_folder.h"
#include "tests/server/ws/live_drill.h"

namespace spinaltap::ws {
namespace {
using namespace test;
using std::chrono::milliseconds;

std::string numbered(std::size_t number) {
  std::string id = "s";
  id += std::to_string(number);
  return id;
}

class DrillHubTest : public testing::Test {
 protected:
  TemporaryFolder folder_;
  store::Store store_ = store::Store::open(folder_.path()).value();
  SmallCase small_ = makeSmallCase(store_);
  Ticket ticket_{small_.case_id, small_.path_id};
  HubOptions options_;
  std::unique_ptr<DrillHub> hub_;

  DrillHub& hub() {
    if (!hub_) hub_ = DrillHub::start(store_, options_).value();
    return *hub_;
  }
  /// A line to session `id`, which begins when it is not there.
  std::unique_ptr<WebSocket> connect(const std::string& id = "s1") {
    if (!hub().knows(id)) {
      EXPECT_TRUE(hub().begin(id, ticket_).has_value());
    }
    int ends[2] = {-1, -1};
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends), 0);
    hub().adopt(ends[0], id, {});
    return std::make_unique<WebSocket>(test::Connection::Pair{ends[1]});
  }
  wire::Welcome drive(WebSocket& socket, const Bytes& hello = helloBytes()) {
    socket.send(hello);
    return decoded<wire::Welcome>(socket.receive().payload);
  }
  template <class Message>
  Message next(WebSocket& socket) {
    return decoded<Message>(socket.receive().payload);
  }
  wire::Feedback drill(WebSocket& socket, std::uint32_t first, const std::vector<session::Input>& poses) {
    socket.send(posesBytes(first, poses));
    return next<wire::Feedback>(socket);
  }
  std::string refusalOf(WebSocket& socket, int code) {
    const auto refused = next<wire::Refused>(socket);
    EXPECT_FALSE(refused.reason.empty());
    EXPECT_EQ(socket.receive().closeCode(), code) << refused.reason;
    return refused.reason;
  }
  std::vector<store::Recording> recordings(std::size_t count) {
    for (int i = 0; i < 500; ++i) {
      auto rows = store_.recordings(small_.case_id).value();
      if (rows.size() >= count) return rows;
      std::this_thread::sleep_for(milliseconds(10));
    }
    return {};
  }
  recording::ReplayReport replayed(const store::Recording& row) {
    return recording::replay(recording::read(store_.blobs().get(row.bytes).value()).value()).value();
  }
};

std::vector<session::Input> part(const std::vector<session::Input>& poses, std::size_t from, std::size_t to) {
  return {poses.begin() + static_cast<std::ptrdiff_t>(from), poses.begin() + static_cast<std::ptrdiff_t>(to)};
}

TEST_F(DrillHubTest, GivesWhatTheCoreGivesAndKeepsARecordingOfIt) {
  const auto poses = somePoses(600);
  const Expected expected = runLocally(store_, small_, poses);
  const auto socket = connect();
  const auto welcome = drive(*socket);
  EXPECT_EQ(welcome.state_hash, expected.start_hash);
  EXPECT_EQ(welcome.points_alive, small_.path.points_alive);
  EXPECT_EQ(welcome.stiffness_N_mm, 0) << "rigid";
  const auto feedback = drill(*socket, 4294967290u, poses);
  EXPECT_EQ(feedback.seq, 4294967290u + 599u) << "sequence numbers wrap";
  EXPECT_EQ(feedback.t_us, poses.back().t_us);
  EXPECT_EQ(feedback.state_hash, expected.hash);
  EXPECT_EQ(feedback.cycle, expected.cycle);
  EXPECT_EQ(feedback.removed_total, expected.removed_total);
  EXPECT_EQ(feedback.thrust_N, expected.thrust_N);
  EXPECT_EQ(feedback.status, session::Status::RefusedNotFinite);
  socket->send(finishBytes());
  const auto row = store_.findRecording(next<wire::Finished>(*socket).recording_id).value();
  EXPECT_EQ(socket->receive().closeCode(), 1000);
  EXPECT_TRUE(row.complete);
  EXPECT_EQ(row.cycles, expected.cycle);
  const auto report = replayed(row);
  EXPECT_TRUE(report.verified);
  EXPECT_EQ(report.state_hash, expected.hash);
}

TEST_F(DrillHubTest, BatchesDoNotMatter) {
  const auto poses = somePoses(500);
  const Expected expected = runLocally(store_, small_, poses);
  for (const std::size_t size : {std::size_t{1}, std::size_t{7}, std::size_t{499}}) {
    const auto socket = connect(numbered(size));
    drive(*socket);
    wire::Feedback last;
    std::uint64_t hashes = 0;
    for (std::size_t at = 0; at < poses.size(); at += size) {
      last = drill(*socket, static_cast<std::uint32_t>(at), part(poses, at, std::min(poses.size(), at + size)));
      hashes += last.has_hash ? 1 : 0;
    }
    EXPECT_EQ(last.removed_total, expected.removed_total) << "batches of " << size;
    if (size == 1) {
      EXPECT_EQ(hashes, expected.cycle / kHashEvery + 1) << "the first cycle, and each multiple";
    }
  }
}

TEST_F(DrillHubTest, AForceComesInTheToolsAndInThePatientsFrameAsThisDeviceCanBearIt) {
  wire::Hello hello;
  hello.max_force_N = 0.5;
  hello.max_stiffness_N_mm = 3;
  auto poses = somePoses(300);
  for (auto& pose : poses) pose.axis = {0, 0.6, 0.8};
  const haptics::Coupling coupling{3, 0};
  const Expected expected = runLocally(store_, small_, poses, coupling);
  const auto socket = connect();
  const auto welcome = drive(*socket, helloBytes(hello));
  EXPECT_EQ(welcome.stiffness_N_mm, 3);
  EXPECT_EQ(welcome.force_scale, 0.5 / haptics::kFullForce_N);
  const auto feedback = drill(*socket, 0, poses);
  ASSERT_GT(norm(expected.last.force_N), 0) << "or nothing is shown";
  EXPECT_EQ(feedback.thrust_N, expected.thrust_N) << "as the bone gives it";
  EXPECT_EQ(feedback.tip_mm, expected.last.bit.tip_mm);
  EXPECT_NE(feedback.tip_mm, poses.back().tip_mm) << "the bit is not where the hand is";
  // scale and limit are two roundings each; 1e-12 N is far below what anything can feel
  const double share = std::min(welcome.force_scale, 0.5 / norm(expected.last.force_N));
  EXPECT_LT(norm(feedback.force_N - expected.last.force_N * share), 1e-12);
  EXPECT_LT(norm(feedback.torque_Nmm - expected.last.torque_Nmm * share), 1e-12);
  EXPECT_EQ(feedback.limited, welcome.force_scale * norm(expected.last.force_N) > 0.5);
  EXPECT_EQ(feedback.local.frontal_mm2, expected.local.frontal_mm2);
  EXPECT_EQ(feedback.local.rubbing_mm2, expected.local.rubbing_mm2);
  EXPECT_EQ(feedback.local.side_mm2, expected.local.side_mm2);
  EXPECT_EQ(feedback.local.side_lever, expected.local.side_lever);
  EXPECT_GT(feedback.local.frontal_mm2[0], 0) << "or nothing is shown";
  const Frame frame = plan::pathFrame(smallPath());
  const Vec3 path_N = haptics::fromTool(feedback.axis, feedback.force_N);
  EXPECT_LT(norm(feedback.force_patient_N - frame.directionToPatient(path_N)), 1e-15);
}

TEST_F(DrillHubTest, AForceAboveTheDevicesMaximumIsShortenedAndSaidToBe) {
  wire::Hello hello = rigidHello();  // a bit that nothing stops asks for hundreds of newtons
  hello.max_force_N = 1;
  const auto socket = connect();
  drive(*socket, helloBytes(hello));
  std::vector<session::Input> plunge(3);
  for (std::size_t i = 0; i < plunge.size(); ++i) {
    plunge[i] = {1000 * i, {0, 0, static_cast<double>(i)}, {0, 0, 1}, true};
  }
  const auto feedback = drill(*socket, 0, plunge);
  ASSERT_GT(feedback.thrust_N, 40) << "or nothing is shown";
  EXPECT_TRUE(feedback.limited);
  EXPECT_NEAR(norm(feedback.force_N), 1, 1e-12);
}

TEST_F(DrillHubTest, RefusesMessagesOutOfOrder) {
  const auto early = connect("s1"), never = connect("s2"), twice = connect("s3"), gap = connect("s4");
  early->send(posesBytes(0, somePoses(1)));
  refusalOf(*early, 1002);
  never->send(finishBytes());
  refusalOf(*never, 1002);
  drive(*twice);
  twice->send(helloBytes());
  refusalOf(*twice, 1002);
  drive(*gap);
  drill(*gap, 10, somePoses(5));
  gap->send(posesBytes(16, somePoses(1)));
  EXPECT_EQ(refusalOf(*gap, 1002), "poses: sequence number 16 where 15 comes next");
}

TEST_F(DrillHubTest, RefusesVersionOneByName) {
  const auto socket = connect();
  socket->send(Bytes{std::byte{1}, std::byte{1}, std::byte{0}, std::byte{0}, std::byte{0}, std::byte{0}});
  EXPECT_NE(refusalOf(*socket, 1002).find("version 1 is no longer spoken"), std::string::npos);
}

TEST_F(DrillHubTest, RefusesEveryTruncationOfAMessage) {
  const auto whole = posesBytes(0, somePoses(2));
  for (std::size_t size = 0; size < whole.size(); size += 3) {
    const auto socket = connect(numbered(size % 30));
    socket->send(std::span(whole).first(size));
    refusalOf(*socket, 1002);
  }
}

TEST_F(DrillHubTest, RefusesAPathThatIsNotThere) {
  ticket_.path_id = "pzzzzzzz";
  const auto socket = connect();
  socket->send(helloBytes());
  refusalOf(*socket, 1008);
}

TEST_F(DrillHubTest, TakesAsManySessionsAsItSaysAndNoMore) {
  for (std::size_t i = 0; i < DrillHub::kMostLive; ++i) {
    ASSERT_TRUE(hub().begin(numbered(i), ticket_).has_value());
  }
  EXPECT_EQ(hub().begin("one more", ticket_).error().code, ErrorCode::Limit);
}

TEST_F(DrillHubTest, WhoVanishesAndComesBackWithTheTokenLosesNothing) {
  const auto poses = somePoses(600);
  wire::Token token{};
  {
    const auto socket = connect();
    token = drive(*socket).token;
    drill(*socket, 7, part(poses, 0, 250));
    socket->send(posesBytes(257, part(poses, 250, 400)));  // and is gone before the answer
  }
  const auto socket = connect();
  const auto welcome = drive(*socket, resumeBytes(token));
  EXPECT_EQ(welcome.next_seq, 407u) << "what came in whole is drilled";
  EXPECT_EQ(welcome.state_hash, runLocally(store_, small_, part(poses, 0, 400)).hash);
  EXPECT_EQ(welcome.token, token);
  const auto feedback = drill(*socket, 407, part(poses, 400, 600));
  EXPECT_EQ(feedback.state_hash, runLocally(store_, small_, poses).hash);
  socket->send(finishBytes());
  std::ignore = next<wire::Finished>(*socket);
  const auto rows = recordings(1);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_TRUE(rows[0].complete);
  EXPECT_TRUE(replayed(rows[0]).verified);
}

TEST_F(DrillHubTest, TheTokenPutsOutALineThatIsDeadButNotSeenToEnd) {
  const auto dead = connect();
  const auto token = drive(*dead).token;
  drill(*dead, 0, somePoses(10));
  const auto socket = connect();
  EXPECT_EQ(drive(*socket, resumeBytes(token)).next_seq, 10u);
  EXPECT_EQ(dead->receive().closeCode(), 1001);
}

TEST_F(DrillHubTest, NobodyElseDrives) {
  const auto socket = connect();
  auto token = drive(*socket).token;
  const auto second = connect();
  second->send(helloBytes());
  refusalOf(*second, 1008);
  token[15] ^= 1;
  const auto thief = connect();
  thief->send(resumeBytes(token));
  refusalOf(*thief, 1008);
  const auto early = connect("s2");
  early->send(resumeBytes(wire::Token{}));
  refusalOf(*early, 1008);
  EXPECT_EQ(drill(*socket, 0, somePoses(3)).seq, 2u) << "who drives notices nothing";
}

TEST_F(DrillHubTest, APausedSessionIsNotTakenWithoutItsToken) {
  {
    const auto socket = connect();
    drive(*socket);
    drill(*socket, 0, somePoses(3));
  }
  std::string reason;
  for (int i = 0; i < 100 && reason.find("token") == std::string::npos; ++i) {  // until the end was seen
    const auto second = connect();
    second->send(helloBytes());
    reason = refusalOf(*second, 1008);
  }
  EXPECT_NE(reason.find("token"), std::string::npos);
}

TEST_F(DrillHubTest, WhoDoesNotComeBackLeavesARecordingThatIsMarkedIncomplete) {
  options_.loop.patience = milliseconds(150);
  const auto poses = somePoses(300);
  wire::Token token{};
  {
    const auto socket = connect();
    token = drive(*socket).token;
    drill(*socket, 0, poses);
  }
  const auto rows = recordings(1);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_FALSE(rows[0].complete);
  EXPECT_EQ(replayed(rows[0]).state_hash, runLocally(store_, small_, poses).hash);
  EXPECT_NE(rows[0].metrics_json.find("peak_thrust_N"), std::string::npos);
  EXPECT_FALSE(hub().knows("s1"));
}

TEST_F(DrillHubTest, KeepsNothingWhenNothingWasDrilled) {
  options_.loop.patience = milliseconds(50);
  const auto socket = connect();
  drive(*socket);
  socket->send(finishBytes());
  EXPECT_EQ(next<wire::Finished>(*socket).recording_id, "");
  drive(*connect("s2"));
  hub_->stop();
  EXPECT_TRUE(store_.recordings(small_.case_id).value().empty());
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path() / "live"));
}

TEST_F(DrillHubTest, AWatcherSeesWhatTheDriverFeelsAndCannotDrive) {
  const auto poses = somePoses(200);
  const auto driver = connect();
  const auto token = drive(*driver).token;
  drill(*driver, 0, part(poses, 0, 100));
  const auto watcher = connect();
  const auto welcome = drive(*watcher, watchBytes());
  EXPECT_EQ(welcome.token, wire::Token{}) << "who watches cannot resume";
  EXPECT_NE(token, wire::Token{});
  EXPECT_EQ(welcome.state_hash, runLocally(store_, small_, part(poses, 0, 100)).hash);
  EXPECT_EQ(next<wire::SessionStatus>(*driver).code, wire::StatusCode::WatcherJoined);
  driver->send(posesBytes(100, part(poses, 100, 200)));
  EXPECT_EQ(driver->receive().payload, watcher->receive().payload);

  watcher->send(posesBytes(200, somePoses(1)));
  refusalOf(*watcher, 1008);
  EXPECT_EQ(next<wire::SessionStatus>(*driver).code, wire::StatusCode::WatcherLeft);

  const auto other = connect();
  drive(*other, watchBytes());
  driver->connection().close();
  EXPECT_EQ(next<wire::SessionStatus>(*other).code, wire::StatusCode::Paused);
  const auto back = connect();
  drive(*back, resumeBytes(token));
  EXPECT_EQ(next<wire::SessionStatus>(*other).code, wire::StatusCode::Resumed);
  back->send(finishBytes());
  EXPECT_EQ(next<wire::Finished>(*back).recording_id, next<wire::Finished>(*other).recording_id);
  EXPECT_EQ(other->receive().closeCode(), 1000);
}

TEST_F(DrillHubTest, NobodyWatchesWhatNobodyDrives) {
  const auto watcher = connect();
  watcher->send(watchBytes());
  refusalOf(*watcher, 1008);
}

TEST_F(DrillHubTest, AWatcherWhoReadsNothingIsCutLooseAndTheDriverNoticesNothing) {
  options_.loop.stall = milliseconds(200);
  const auto driver = connect();
  drive(*driver);
  drill(*driver, 0, somePoses(1));
  const auto watcher = connect();
  drive(*watcher, watchBytes());
  EXPECT_EQ(next<wire::SessionStatus>(*driver).code, wire::StatusCode::WatcherJoined);
  const session::Input still{1'000'000, {0, 0, -1}, {0, 0, 1}, true};
  for (std::uint32_t seq = 1;; ++seq) {
    ASSERT_LT(seq, 2'000'000u);
    driver->send(posesBytes(seq, {still}));
    const auto message = wire::decodeServerMessage(driver->receive().payload).value();
    if (const auto* status = std::get_if<wire::SessionStatus>(&message)) {
      EXPECT_EQ(status->code, wire::StatusCode::WatcherLeft);
      break;
    }
    ASSERT_EQ(std::get<wire::Feedback>(message).seq, seq) << "each is answered, at once";
  }
  EXPECT_NE(hub().metricsText().find("\nspinaltap_cut_loose_total 1\n"), std::string::npos);
}

TEST_F(DrillHubTest, ADriverWhoReadsNothingIsAnsweredByTheNewestAndLosesNoHashOrStatus) {
  const auto socket = connect();
  drive(*socket);
  constexpr std::uint32_t kPoses = 20'000;
  session::Input pose{1, {0, 0, -1}, {0, 0, 1}, true};
  for (std::uint32_t seq = 0; seq < kPoses; ++seq) {
    session::Input sent = pose;
    if (seq == kPoses - 100) sent.tip_mm.x = std::numeric_limits<double>::infinity();
    ASSERT_TRUE(socket->send(posesBytes(seq, {sent})));
  }
  wire::Feedback last;
  session::Status worst = session::Status::Ok;
  std::uint32_t answers = 0;
  while (last.seq + 1 < kPoses) {
    last = nextFeedback(*socket);
    worst = std::max(worst, last.status);
    ++answers;
  }
  EXPECT_LT(answers, kPoses);
  EXPECT_EQ(worst, session::Status::RefusedNotFinite) << "of a pose whose own answer was replaced";
  EXPECT_EQ(last.cycle, kPoses - 1);
  socket->send(finishBytes());
  EXPECT_FALSE(next<wire::Finished>(*socket).recording_id.empty());
}

TEST_F(DrillHubTest, FeedbackComesNoOftenerThanTheClientTakesIt) {
  wire::Hello hello = rigidHello();
  hello.max_rate_hz = 20;
  const auto socket = connect();
  drive(*socket, helloBytes(hello));
  const auto begun = std::chrono::steady_clock::now();
  for (std::uint32_t seq = 0; seq < 300; ++seq) {
    socket->send(posesBytes(seq, {session::Input{}}));
    std::this_thread::sleep_for(milliseconds(1));
  }
  int answers = 0;
  for (wire::Feedback last; last.seq != 299; ++answers) last = nextFeedback(*socket);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  EXPECT_LE(answers, 20 * seconds + 2) << "the first at once, and the one under way";
  EXPECT_GE(answers, 2);
}

TEST_F(DrillHubTest, PingsAreAnsweredAndACloseIsReturned) {
  const auto socket = connect();
  drive(*socket);
  const Bytes word{std::byte{'h'}, std::byte{'i'}};
  socket->send(word, 9);
  const auto pong = socket->receive();
  EXPECT_EQ(pong.opcode, 10u);
  EXPECT_EQ(pong.payload, word);
  socket->send(Bytes{std::byte{0x03}, std::byte{0xe8}}, 8);
  EXPECT_EQ(socket->receive().closeCode(), 1000);
  EXPECT_EQ(socket->receive().opcode, 0u) << "then the line ends";
}

TEST_F(DrillHubTest, EverySessionHasItsTurnWhileAnotherIsFlooded) {
  options_.loops = 1;
  const auto greedy = connect("s1"), modest = connect("s2");
  drive(*greedy);
  drive(*modest);
  constexpr std::uint32_t kBatches = 60, kPoses = wire::kMaxPosesPerBatch;
  std::atomic<std::uint32_t> seq = 0;
  std::atomic<bool> ends = false;
  std::thread trainee([&] {
    for (; !ends; ++seq) EXPECT_EQ(drill(*modest, seq, {session::Input{}}).seq, seq);
  });
  std::thread reader([&] {
    while (nextFeedback(*greedy).seq + 1 != kBatches * kPoses) {
    }
  });
  const std::vector<session::Input> batch(kPoses);
  for (std::uint32_t i = 0; i < kBatches; ++i) greedy->send(posesBytes(i * kPoses, batch));
  reader.join();
  // Slices of kSlice poses alternate with the other's: at most one of these to one of its cycles, were it never slow
  // to send; one in eight leaves room for its thread to be kept waiting. A whole batch in between gives one in 128.
  EXPECT_GT(seq, kBatches * kPoses / DrillLoop::kSlice / 8);
  ends = true;
  trainee.join();
}

TEST_F(DrillHubTest, WhoSendsFasterThanItIsDrilledIsToldSo) {
  options_.loop.overload = milliseconds(1);
  const auto socket = connect();
  drive(*socket);
  std::atomic<bool> told = false;
  std::thread sender([&] {
    const std::vector<session::Input> batch(wire::kMaxPosesPerBatch);
    const auto size = static_cast<std::uint32_t>(batch.size());
    for (std::uint32_t i = 0; i < 5000 && !told; ++i) socket->send(posesBytes(i * size, batch));
  });
  while (!told) {
    const auto message = wire::decodeServerMessage(socket->receive().payload);
    if (!message) break;
    const auto* status = std::get_if<wire::SessionStatus>(&*message);
    told = status && status->code == wire::StatusCode::Overload;
  }
  EXPECT_TRUE(told);
  told = true;
  sender.join();
}

}  // namespace
}  // namespace spinaltap::ws
