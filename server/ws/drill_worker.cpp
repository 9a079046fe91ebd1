#include "server/ws/drill_worker.h"

#include <atomic>
#include <condition_variable>
#include <deque>
#include <exception>
#include <thread>

namespace spinaltap::ws {

class WorkerSet::Thread final : public DrillWorker {
 public:
  Thread(store::Store& store, const Ticket& ticket, WorkerCallbacks callbacks)
      : callbacks_(std::move(callbacks)), thread_([this, &store, ticket] { work(store, ticket); }) {}
  ~Thread() override { join(); }

  bool offer(std::vector<std::byte>& message) override {
    const std::scoped_lock lock(mutex_);
    if (queue_.size() >= kQueue) {
      waiting_ = true;
      return false;
    }
    queue_.push_back(std::move(message));
    changed_.notify_one();
    return true;
  }
  void hangUp() override {
    const std::scoped_lock lock(mutex_);
    hung_up_ = true;
    changed_.notify_one();
  }
  void join() {
    hangUp();
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] bool ended() const { return ended_; }

 private:
  void work(store::Store& store, const Ticket& ticket) {
    {
      DrillSession session(store, ticket);
      std::vector<std::byte> message;
      while (next(message)) {
        Answer answer = answerTo(session, message);
        if (answer.message.empty()) continue;
        const bool closes = answer.close_code != 0;
        callbacks_.answer(std::move(answer));
        if (closes) break;
      }
    }  // keeps what an interrupted drill left
    ended_ = true;
  }
  /// One drill that runs out of memory must not end the others.
  static Answer answerTo(DrillSession& session, const std::vector<std::byte>& message) {
    try {
      return session.onMessage(message);
    } catch (const std::exception&) {
      return refusal("the server ran out of something", kInternalError);
    }
  }
  /// False when the other side is gone and nothing is left to do.
  bool next(std::vector<std::byte>& message) {
    bool made_room = false;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return hung_up_ || !queue_.empty(); });
      if (queue_.empty()) return false;
      message = std::move(queue_.front());
      queue_.pop_front();
      made_room = std::exchange(waiting_, false);
    }
    if (made_room) callbacks_.room();
    return true;
  }

  WorkerCallbacks callbacks_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::vector<std::byte>> queue_;
  bool hung_up_ = false, waiting_ = false;
  std::atomic<bool> ended_ = false;
  std::thread thread_;  // last: it uses all of the above
};

Result<std::shared_ptr<DrillWorker>> WorkerSet::start(const Ticket& ticket, WorkerCallbacks callbacks) {
  const std::scoped_lock lock(mutex_);
  std::erase_if(live_, [](const auto& thread) { return thread->ended(); });
  if (live_.size() >= kMostLive) return fail(ErrorCode::Limit, "too many drills at once");
  live_.push_back(std::make_shared<Thread>(store_, ticket, std::move(callbacks)));
  return std::shared_ptr<DrillWorker>(live_.back());
}

void WorkerSet::stop() {
  std::vector<std::shared_ptr<Thread>> threads;
  {
    const std::scoped_lock lock(mutex_);
    threads.swap(live_);
  }
  for (const auto& thread : threads) thread->hangUp();
  for (const auto& thread : threads) thread->join();
}

}  // namespace spinaltap::ws
