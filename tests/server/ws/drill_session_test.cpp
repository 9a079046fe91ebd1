#include "server/ws/drill_session.h"

#include <gtest/gtest.h>

#include "core/recording/recording.h"
#include "server/ws/drill_worker.h"
#include "server/ws/waiting_room.h"
#include "tests/server/temporary_folder.h"
#include "tests/server/ws/live_drill.h"

namespace spinaltap::ws {
namespace {
using namespace test;

class DrillSessionTest : public testing::Test {
 protected:
  TemporaryFolder folder_;
  store::Store store_ = store::Store::open(folder_.path()).value();
  SmallCase small_ = makeSmallCase(store_);
  Ticket ticket_{small_.case_id, small_.path_id};

  void expectRefused(const Answer& answer, std::uint16_t code) {
    EXPECT_FALSE(decoded<wire::Refused>(answer.message).reason.empty());
    EXPECT_EQ(answer.close_code, code);
  }
};

TEST_F(DrillSessionTest, GivesWhatTheCoreGivesAndKeepsARecordingOfIt) {
  const auto poses = somePoses(600);
  const Expected expected = runLocally(store_, small_, poses);
  DrillSession session(store_, ticket_);
  const auto welcome = decoded<wire::Welcome>(session.onMessage(helloBytes()).message);
  EXPECT_EQ(welcome.state_hash, expected.start_hash);
  EXPECT_EQ(welcome.points_alive, small_.path.points_alive);
  const auto feedback = decoded<wire::Feedback>(session.onMessage(posesBytes(4294967290u, poses)).message);
  EXPECT_EQ(feedback.seq, 4294967290u + 599u) << "sequence numbers wrap";
  EXPECT_EQ(feedback.state_hash, expected.hash);
  EXPECT_EQ(feedback.cycle, expected.cycle);
  EXPECT_EQ(feedback.removed_total, expected.removed_total);
  EXPECT_EQ(feedback.thrust_N, expected.thrust_N);
  EXPECT_EQ(feedback.status, session::Status::RefusedNotFinite);
  const Answer end = session.onMessage(finishBytes());
  EXPECT_EQ(end.close_code, kNormal);
  const auto row = store_.findRecording(decoded<wire::Finished>(end.message).recording_id).value();
  EXPECT_TRUE(row.complete);
  EXPECT_EQ(row.cycles, expected.cycle);
  const auto replayed = recording::replay(recording::read(store_.blobs().get(row.bytes).value()).value()).value();
  EXPECT_TRUE(replayed.verified);
  EXPECT_EQ(replayed.state_hash, expected.hash);
}

TEST_F(DrillSessionTest, BatchesDoNotMatter) {
  const auto poses = somePoses(500);
  const Expected expected = runLocally(store_, small_, poses);
  for (const std::size_t size : {std::size_t{1}, std::size_t{7}, std::size_t{499}}) {
    DrillSession session(store_, ticket_);
    std::ignore = session.onMessage(helloBytes());
    wire::Feedback last;
    for (std::size_t at = 0; at < poses.size(); at += size) {
      const auto end = std::min(poses.size(), at + size);
      last = decoded<wire::Feedback>(
          session
              .onMessage(posesBytes(static_cast<std::uint32_t>(at), {poses.begin() + static_cast<std::ptrdiff_t>(at),
                                                                     poses.begin() + static_cast<std::ptrdiff_t>(end)}))
              .message);
    }
    EXPECT_EQ(last.state_hash, expected.hash) << "batches of " << size;
  }
}

TEST_F(DrillSessionTest, RefusesMessagesOutOfOrder) {
  expectRefused(DrillSession(store_, ticket_).onMessage(posesBytes(0, somePoses(1))), kProtocolError);
  expectRefused(DrillSession(store_, ticket_).onMessage(finishBytes()), kProtocolError);
  DrillSession twice(store_, ticket_);
  std::ignore = twice.onMessage(helloBytes());
  expectRefused(twice.onMessage(helloBytes()), kProtocolError);
  EXPECT_TRUE(twice.onMessage(helloBytes()).message.empty()) << "nothing is answered after a refusal";
  DrillSession gap(store_, ticket_);
  std::ignore = gap.onMessage(helloBytes());
  std::ignore = gap.onMessage(posesBytes(10, somePoses(5)));
  expectRefused(gap.onMessage(posesBytes(16, somePoses(1))), kProtocolError);
}

TEST_F(DrillSessionTest, RefusesEveryTruncationOfAMessage) {
  const auto whole = posesBytes(0, somePoses(2));
  for (std::size_t size = 0; size < whole.size(); ++size) {
    DrillSession session(store_, ticket_);
    expectRefused(session.onMessage({whole.data(), size}), kProtocolError);
  }
}

TEST_F(DrillSessionTest, RefusesAPathThatIsNotThere) {
  DrillSession session(store_, {small_.case_id, "pzzzzzzz"});
  expectRefused(session.onMessage(helloBytes()), kPolicy);
}

TEST_F(DrillSessionTest, KeepsWhatWasDrilledWhenTheTraineeGoesAway) {
  const auto poses = somePoses(300);
  const Expected expected = runLocally(store_, small_, poses);
  {
    DrillSession session(store_, ticket_);
    std::ignore = session.onMessage(helloBytes());
    std::ignore = session.onMessage(posesBytes(0, poses));
  }
  const auto rows = store_.recordings(small_.case_id).value();
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_FALSE(rows[0].complete);
  EXPECT_EQ(rows[0].cycles, expected.cycle);
  EXPECT_NE(rows[0].metrics_json.find("peak_thrust_N"), std::string::npos);
}

TEST_F(DrillSessionTest, KeepsNothingWhenNothingWasDrilled) {
  {
    DrillSession session(store_, ticket_);
    std::ignore = session.onMessage(helloBytes());
    const auto finished = decoded<wire::Finished>(session.onMessage(finishBytes()).message);
    EXPECT_EQ(finished.recording_id, "");
  }
  DrillSession(store_, ticket_).hangUp();
  EXPECT_TRUE(store_.recordings(small_.case_id).value().empty());
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path() / "live"));
}

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

TEST_F(DrillSessionTest, AFullQueueSaysSoAndLosesNothing) {
  WorkerSet workers(store_);
  std::mutex mutex;
  std::condition_variable changed;
  int answers = 0, rooms = 0;
  const auto worker = workers
                          .start(ticket_, {[&](const Answer&) {
                                             const std::scoped_lock lock(mutex);
                                             ++answers;
                                             changed.notify_all();
                                           },
                                           [&] {
                                             const std::scoped_lock lock(mutex);
                                             ++rooms;
                                             changed.notify_all();
                                           }})
                          .value();
  constexpr std::uint32_t kBatches = 200, kPoses = 50;
  auto hello = helloBytes();
  ASSERT_TRUE(worker->offer(hello));
  bool was_full = false;
  for (std::uint32_t i = 0; i < kBatches; ++i) {
    auto message = posesBytes(i * kPoses, somePoses(kPoses));
    std::unique_lock lock(mutex);
    int seen = rooms;
    lock.unlock();
    while (!worker->offer(message)) {
      was_full = true;
      lock.lock();
      ASSERT_TRUE(changed.wait_for(lock, std::chrono::seconds(30), [&] { return rooms > seen; }));
      seen = rooms;
      lock.unlock();
    }
  }
  std::unique_lock lock(mutex);
  EXPECT_TRUE(changed.wait_for(lock, std::chrono::seconds(60), [&] { return answers == 1 + int{kBatches}; }));
  EXPECT_TRUE(was_full);
  lock.unlock();
  workers.stop();
  EXPECT_EQ(store_.recordings(small_.case_id).value().size(), 1u);
}

}  // namespace
}  // namespace spinaltap::ws
