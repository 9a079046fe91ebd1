// server/haptic_client/network.h - the network's thread of a client: poses out, answers in, and a line that is resumed
// by its token when it breaks. What was not answered is kept, so that nothing is lost and nothing is drilled twice.
#pragma once
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "server/haptic_client/device_loop.h"
#include "server/haptic_client/line.h"
#include "server/haptic_client/spsc_ring.h"

namespace spinaltap::haptic_client {

struct NetworkSetup {
  Address server;
  std::string session;
  wire::Hello hello;
  std::chrono::milliseconds patience{10'000};    ///< for one step of connecting
  std::chrono::milliseconds resume_for{60'000};  ///< as long as the server keeps a session that nobody drives
};

class Network final : public Link {
 public:
  /// Connects, says hello and starts the thread. @error as Line::open; Unsupported: a bit that is held rigidly.
  [[nodiscard]] static Result<std::unique_ptr<Network>> start(const NetworkSetup& setup);
  ~Network() override;
  [[nodiscard]] const wire::Welcome& welcome() const { return welcome_; }

  // Of the device loop's thread; they do not wait. A pose more than kMostPoses ahead of the network's thread is an end.
  void send(std::uint32_t seq, const session::Input& pose) override;
  bool take(Answer& into) override { return answers_.pop(into); }
  [[nodiscard]] std::uint32_t resumed() const override { return resumed_.load(std::memory_order_acquire); }
  /// Sleeps until pose `seq` is answered, the line was resumed since `resumed`, or all has ended.
  void waitForAnswer(std::uint32_t seq, std::uint32_t resumed, const std::atomic<bool>& stopping);
  /// Who waits looks again.
  void tell();

  // From any thread.
  [[nodiscard]] bool hasEnded() const { return ended_.load(std::memory_order_acquire); }
  [[nodiscard]] bool isBroken() const { return broken_.load(std::memory_order_acquire); }
  /// Why it ended.
  [[nodiscard]] Error error() const;
  [[nodiscard]] std::thread::native_handle_type thread() { return thread_.native_handle(); }

  /// Sends what waits, then asks the server to complete the recording, and waits for it. Nothing is sent after it.
  /// @error Io, Limit.
  [[nodiscard]] Result<wire::Finished> finish(std::chrono::milliseconds patience);
  /// Round trips so far, us, in no order; at most kMostRoundTrips. @pre finish() returned, or hasEnded().
  [[nodiscard]] const std::vector<std::uint32_t>& roundTrips_us() const { return round_trips_us_; }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMostPoses = 4096, kMostAnswers = 1024, kMostRoundTrips = 4'000'000;
  struct Pose {
    std::uint32_t seq = 0;
    session::Input input;
    Clock::time_point at;
  };

  Network(const NetworkSetup& setup, Line line, int wake);
  void run();
  void wait(std::chrono::milliseconds most);
  void gather();
  [[nodiscard]] bool sendWaiting();
  [[nodiscard]] bool receive();
  void onMessage(std::span<const std::byte> bytes);
  void onFeedback(const wire::Feedback& feedback);
  void resume();
  void dropTaken(std::uint32_t next_seq);
  void end(Error error);
  void wakeUp() const;

  NetworkSetup setup_;
  int wake_;
  wire::Welcome welcome_;
  SpscRing<Pose, kMostPoses> poses_;
  SpscRing<Answer, kMostAnswers> answers_;
  std::atomic<bool> stopping_ = false, finishing_ = false, ended_ = false, broken_ = false, overrun_ = false;
  std::atomic<std::uint32_t> resumed_ = 0;
  std::atomic<std::uint32_t> answered_ = 0;  ///< as many poses

  mutable std::mutex mutex_;  ///< guards what follows
  std::condition_variable told_;
  std::optional<wire::Finished> finished_;
  Error error_;

  // the thread's own
  Line line_;
  std::deque<Pose> unanswered_;
  std::size_t handed_over_ = 0;  ///< of these, to the line
  std::optional<Answer> late_;   ///< the newest, for which there was no room
  bool finish_sent_ = false;
  std::vector<std::uint32_t> round_trips_us_;
  std::vector<session::Input> batch_;
  std::thread thread_;
};

}  // namespace spinaltap::haptic_client
