// server/ws/drill_worker.h - a thread a drill session, apart from those that serve files.
#pragma once
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "core/base/result.h"
#include "server/store/store.h"
#include "server/ws/drill_session.h"

namespace spinaltap::ws {

/// Called from the worker's thread; both must return at once.
struct WorkerCallbacks {
  std::function<void(Answer)> answer;
  std::function<void()> room;  ///< the queue, which was full, has room again
};

class DrillWorker {
 public:
  static constexpr std::size_t kQueue = 16;  ///< messages; a batch is at most 4 s of poses

  virtual ~DrillWorker() = default;
  DrillWorker(const DrillWorker&) = delete;
  DrillWorker& operator=(const DrillWorker&) = delete;
  /// False when the queue is full: wait for room() and offer the same message again. Never blocks.
  [[nodiscard]] virtual bool offer(std::vector<std::byte>& message) = 0;
  /// What is queued is still drilled and recorded, then the thread ends. Never blocks.
  virtual void hangUp() = 0;

 protected:
  DrillWorker() = default;
};

/// All live drills. Safe from several threads.
class WorkerSet {
 public:
  static constexpr std::size_t kMostLive = 64;

  explicit WorkerSet(store::Store& store) : store_(store) {}
  WorkerSet(const WorkerSet&) = delete;
  WorkerSet& operator=(const WorkerSet&) = delete;
  ~WorkerSet() { stop(); }

  /// @error Limit.
  [[nodiscard]] Result<std::shared_ptr<DrillWorker>> start(const Ticket& ticket, WorkerCallbacks callbacks);
  /// Hangs up and waits until every recording is kept.
  void stop();

 private:
  class Thread;
  store::Store& store_;
  std::mutex mutex_;
  std::vector<std::shared_ptr<Thread>> live_;
};

}  // namespace spinaltap::ws
