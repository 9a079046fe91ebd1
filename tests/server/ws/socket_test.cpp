// A live drill on the real server, over a real socket.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <thread>

#include "core/recording/recording.h"
#include "tests/server/program.h"
#include "tests/server/sockets.h"
#include "tests/server/temporary_folder.h"
#include "tests/server/ws/live_drill.h"

namespace spinaltap::test {
namespace {

class LiveDrill : public testing::Test {
 protected:
  TemporaryFolder folder_;
  store::Store store_ = store::Store::open(folder_.path()).value();
  SmallCase small_ = makeSmallCase(store_);
  Server server_{folder_.path().string()};

  std::string socketUrl() {
    const Reply reply =
        post(server_.port(), "/api/v1/sessions", {{"case_id", small_.case_id}, {"path_id", small_.path_id}});
    return "/ws/drill/" + reply.json().value("id", "");
  }
  /// Waits until the server has kept `count` recordings.
  std::vector<store::Recording> recordings(std::size_t count) {
    for (int i = 0; i < 500; ++i) {
      auto rows = store_.recordings(small_.case_id).value();
      if (rows.size() >= count) return rows;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return {};
  }
  void expectRefusedWith(WebSocket& socket, int code) {
    const auto refused = socket.receive();
    EXPECT_FALSE(decoded<wire::Refused>(refused.payload).reason.empty());
    EXPECT_EQ(socket.receive().closeCode(), code);
  }
  recording::ReplayReport replayed(const store::Recording& row) {
    return recording::replay(recording::read(store_.blobs().get(row.bytes).value()).value()).value();
  }
};

TEST_F(LiveDrill, GivesTheSameHashAsTheCoreHere) {
  const auto poses = somePoses(600);
  const Expected expected = runLocally(store_, small_, poses);
  WebSocket socket(server_.port(), socketUrl());
  ASSERT_EQ(socket.reply().status, 101);
  socket.send(helloBytes());
  EXPECT_EQ(decoded<wire::Welcome>(socket.receive().payload).state_hash, expected.start_hash);
  for (std::uint32_t at = 0; at < poses.size(); at += 20) {
    socket.send(posesBytes(at, {poses.begin() + at, poses.begin() + at + 20}));
  }
  wire::Feedback last;
  for (std::uint32_t at = 0; at < poses.size(); at += 20) {
    last = decoded<wire::Feedback>(socket.receive().payload);
    EXPECT_EQ(last.seq, at + 19) << "one feedback a batch, in order";
  }
  ASSERT_TRUE(last.has_hash) << "20 poses are more than the cycles from hash to hash";
  EXPECT_EQ(last.state_hash, expected.hash);
  EXPECT_EQ(last.removed_total, expected.removed_total);
  socket.send(finishBytes());
  const auto finished = decoded<wire::Finished>(socket.receive().payload);
  EXPECT_EQ(socket.receive().closeCode(), 1000);
  EXPECT_GT(Json::parse(finished.metrics_json)["peak_thrust_N"], 0);

  const Reply bytes = get(server_.port(), "/api/v1/recordings/" + finished.recording_id);
  const auto* data = reinterpret_cast<const std::byte*>(bytes.body.data());
  const auto report = recording::replay(recording::read({data, bytes.body.size()}).value()).value();
  EXPECT_TRUE(report.verified);
  EXPECT_EQ(report.state_hash, expected.hash);
}

TEST_F(LiveDrill, DisconnectingInTheMiddleOfAFrameKeepsTheRecordingWhenTheServerEnds) {
  const auto poses = somePoses(400);
  {
    WebSocket socket(server_.port(), socketUrl());
    socket.send(helloBytes());
    socket.send(posesBytes(0, {poses.begin(), poses.begin() + 300}));
    std::ignore = socket.receive();
    const auto feedback = decoded<wire::Feedback>(socket.receive().payload);
    EXPECT_EQ(feedback.seq, 299u);
    const std::string frame = WebSocket::frame(posesBytes(300, {poses.begin() + 300, poses.end()}));
    socket.connection().send(frame.substr(0, frame.size() / 2));
  }
  EXPECT_EQ(get(server_.port(), "/healthz").status, 200);
  EXPECT_TRUE(store_.recordings(small_.case_id).value().empty()) << "it may be resumed";
  EXPECT_EQ(server_.end(), 0);
  const auto rows = recordings(1);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_FALSE(rows[0].complete);
  const auto report = replayed(rows[0]);
  EXPECT_TRUE(report.verified);
  EXPECT_EQ(report.state_hash, runLocally(store_, small_, {poses.begin(), poses.begin() + 300}).hash);
}

TEST_F(LiveDrill, MalformedMessagesCloseWith1002) {
  auto version = helloBytes(), type = helloBytes(), poses = posesBytes(0, somePoses(1));
  version[1] = std::byte{1};
  type[0] = std::byte{99};
  poses.pop_back();
  for (const Bytes& bad : {version, type, poses, Bytes{}}) {
    WebSocket socket(server_.port(), socketUrl());
    socket.send(bad);
    expectRefusedWith(socket, 1002);
  }
  WebSocket text(server_.port(), socketUrl());
  text.send(helloBytes(), 1);
  const auto answer = text.receive();  // not UTF-8, or a text: either way a protocol error
  if (answer.opcode == 8) {
    EXPECT_TRUE(answer.closeCode() == 1002 || answer.closeCode() == 1007);
  } else {
    EXPECT_EQ(text.receive().closeCode(), 1002);
  }
}

TEST_F(LiveDrill, AMessageThatIsTooLargeClosesWith1009) {
  WebSocket socket(server_.port(), socketUrl());
  socket.send(Bytes(300'000, std::byte{2}));
  EXPECT_EQ(socket.receive().closeCode(), 1009);
}

TEST_F(LiveDrill, ASessionIsTakenOnlyFromItsOwnPagesAndByOneDriver) {
  const std::string url = socketUrl();
  EXPECT_EQ(WebSocket(server_.port(), url, {"Origin: https://evil.example"}).reply().status, 403);
  WebSocket first(server_.port(), url, {"Origin: http://127.0.0.1"});
  EXPECT_EQ(first.reply().status, 101) << "still unused";
  first.send(helloBytes());
  std::ignore = decoded<wire::Welcome>(first.receive().payload);
  WebSocket second(server_.port(), url);
  second.send(helloBytes());
  expectRefusedWith(second, 1008);
  EXPECT_EQ(WebSocket(server_.port(), "/ws/drill/snever").reply().status, 404);
  EXPECT_EQ(WebSocket(server_.port(), "/ws/other").reply().status, 404);
  EXPECT_EQ(get(server_.port(), "/ws/drill/snever").status, 426);
}

TEST_F(LiveDrill, IsResumedByItsTokenOnTheSameAddress) {
  const auto poses = somePoses(400);
  const std::string url = socketUrl();
  wire::Token token{};
  {
    WebSocket socket(server_.port(), url);
    socket.send(helloBytes());
    token = decoded<wire::Welcome>(socket.receive().payload).token;
    socket.send(posesBytes(0, {poses.begin(), poses.begin() + 200}));
    std::ignore = socket.receive();
  }
  WebSocket socket(server_.port(), url);
  ASSERT_EQ(socket.reply().status, 101);
  socket.send(resumeBytes(token));
  const auto welcome = decoded<wire::Welcome>(socket.receive().payload);
  EXPECT_EQ(welcome.next_seq, 200u);
  socket.send(posesBytes(200, {poses.begin() + 200, poses.end()}));
  EXPECT_EQ(decoded<wire::Feedback>(socket.receive().payload).seq, 399u);
  socket.send(finishBytes());
  std::ignore = decoded<wire::Finished>(socket.receive().payload);
  const auto rows = recordings(1);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_TRUE(rows[0].complete);
  EXPECT_EQ(replayed(rows[0]).state_hash, runLocally(store_, small_, poses).hash);
}

TEST_F(LiveDrill, MetricsCountWhatWasDrilled) {
  WebSocket socket(server_.port(), socketUrl());
  socket.send(helloBytes());
  std::ignore = socket.receive();
  socket.send(posesBytes(0, somePoses(300)));
  std::ignore = socket.receive();
  const Reply reply = get(server_.port(), "/metrics");
  EXPECT_EQ(reply.status, 200);
  EXPECT_EQ(reply.header("content-type").rfind("text/plain; version=0.0.4", 0), 0u);
  EXPECT_NE(reply.body.find("\nspinaltap_cycles_total 300\n"), std::string::npos);
  EXPECT_NE(reply.body.find("\nspinaltap_cycle_seconds_count 300\n"), std::string::npos);
  EXPECT_NE(reply.body.find("\nspinaltap_cycle_seconds_bucket{le=\"+Inf\"} 300\n"), std::string::npos);
  std::string body = reply.body;  // an answer is counted once it is sent, which we may have read before that
  for (int i = 0; i < 100 && body.find("\nspinaltap_answer_seconds_count 1\n") == std::string::npos; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    body = get(server_.port(), "/metrics").body;
  }
  EXPECT_NE(body.find("\nspinaltap_answer_seconds_count 1\n"), std::string::npos);
}

TEST_F(LiveDrill, SeveralAtOnceDoNotDisturbEachOther) {
  const auto poses = somePoses(500);
  const Expected expected = runLocally(store_, small_, poses);
  std::vector<std::thread> trainees;
  for (int t = 0; t < 4; ++t) {
    trainees.emplace_back([&, url = socketUrl()] {
      WebSocket socket(server_.port(), url);
      socket.send(helloBytes());
      std::ignore = socket.receive();
      wire::Feedback last;
      for (std::uint32_t at = 0; at < poses.size(); at += 20) {
        socket.send(posesBytes(at, {poses.begin() + at, poses.begin() + at + 20}));
        last = decoded<wire::Feedback>(socket.receive().payload);
      }
      EXPECT_EQ(last.state_hash, expected.hash);
      socket.send(finishBytes());
      std::ignore = socket.receive();
    });
  }
  for (auto& trainee : trainees) trainee.join();
  EXPECT_EQ(recordings(4).size(), 4u);
}

/// What a process holds in memory, kB.
long residentKb(int id) {
  std::ifstream status("/proc/" + std::to_string(id) + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmRSS:", 0) == 0) return std::atol(line.c_str() + 6);
  }
  return 0;
}

TEST_F(LiveDrill, ATraineeWhoReadsNothingIsAnsweredWithTheNewestAndCostsNoMemory) {
  // 26 MB of answers, many times what the system holds unsent and unread together (4 MiB, tcp_wmem, at the most)
  constexpr std::uint32_t kBatches = 100'000, kWarm = 20'000;
  const std::vector<session::Input> batch(1);  // the bit stands still
  WebSocket socket(server_.port(), socketUrl(), {}, 4096);
  socket.send(helloBytes());
  std::uint32_t sent = 0;
  const auto sendUpTo = [&](std::uint32_t end) {
    while (sent < end) ASSERT_TRUE(socket.send(posesBytes(sent++, batch)));
  };
  sendUpTo(kWarm);
  const long before_kb = residentKb(server_.id());
  sendUpTo(kBatches);
  EXPECT_LT(residentKb(server_.id()), before_kb + 24 * 1024)
      << "the recording's last seconds and allocator slack, not 21 MB of answers and what they are queued in";
  EXPECT_EQ(get(server_.port(), "/healthz").status, 200) << "others are served meanwhile";
  std::ignore = decoded<wire::Welcome>(socket.receive().payload);
  std::uint32_t answers = 0, seq = 0;
  for (bool first = true; seq + 1 < kBatches; first = false) {
    const auto feedback = nextFeedback(socket);
    ASSERT_TRUE(first || feedback.seq > seq) << "never an older one after a newer one";
    seq = feedback.seq;
    ++answers;
  }
  EXPECT_LT(answers, kBatches) << "most were replaced by newer ones";
  socket.send(finishBytes());
  std::ignore = decoded<wire::Finished>(socket.receive().payload);
}

TEST_F(LiveDrill, EndingTheServerKeepsWhatIsBeingDrilled) {
  const auto poses = somePoses(300);
  WebSocket socket(server_.port(), socketUrl());
  socket.send(helloBytes());
  socket.send(posesBytes(0, poses));
  std::ignore = socket.receive();
  std::ignore = socket.receive();
  std::thread reader([&] {
    const auto close = socket.receive();
    EXPECT_EQ(close.closeCode(), 1001);
    socket.send(close.payload, 8);
  });
  EXPECT_EQ(server_.end(), 0);
  reader.join();
  const auto rows = recordings(1);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_FALSE(rows[0].complete);
  EXPECT_EQ(replayed(rows[0]).state_hash, runLocally(store_, small_, poses).hash);
}

TEST_F(LiveDrill, AKilledServerLosesAtMostTheLastSecond) {
  const auto poses = somePoses(300);
  {
    WebSocket socket(server_.port(), socketUrl());
    socket.send(helloBytes());
    std::ignore = socket.receive();
    socket.send(posesBytes(0, {poses.begin(), poses.begin() + 200}));
    std::ignore = socket.receive();
    std::this_thread::sleep_for(std::chrono::milliseconds(1100));
    socket.send(posesBytes(200, {poses.begin() + 200, poses.end()}));
    std::ignore = socket.receive();
    server_.end(SIGKILL);
  }
  EXPECT_TRUE(store_.recordings(small_.case_id).value().empty());
  const Server second(folder_.path().string());
  const auto rows = recordings(1);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_FALSE(rows[0].complete);
  EXPECT_TRUE(replayed(rows[0]).verified);
  EXPECT_GE(recording::read(store_.blobs().get(rows[0].bytes).value()).value().inputs.size(), 200u);
}

}  // namespace
}  // namespace spinaltap::test
