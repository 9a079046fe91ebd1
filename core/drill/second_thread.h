// core/drill/second_thread.h - a thread that waits awake to take half of a cycle. Private to core/drill.
#pragma once
#include "core/base/function_ref.h"

#ifndef __EMSCRIPTEN__
#include <atomic>
#include <thread>
#endif

namespace spinaltap::drill {

#ifdef __EMSCRIPTEN__
/// In the browser there is no second thread: run() does both.
class SecondThread {
 public:
  static void run(FunctionRef<void()> theirs, FunctionRef<void()> ours) { theirs(), ours(); }
};
#else
/// Handing over takes an atomic store and a look that never sleeps, a fraction of a microsecond, while runs come within
/// some 100 us of each other; later the thread sleeps, and has to be woken first.
class SecondThread {
 public:
  SecondThread() : thread_([this](const std::stop_token& stop) { loop(stop); }) {}
  ~SecondThread() {
    thread_.request_stop();
    hand(nullptr);
  }
  SecondThread(const SecondThread&) = delete;
  SecondThread& operator=(const SecondThread&) = delete;

  /// Runs `theirs` there and `ours` here; returns when both are done. They must not throw.
  void run(FunctionRef<void()> theirs, FunctionRef<void()> ours) {
    hand(&theirs);
    ours();
    while (work_.load(std::memory_order_acquire) != nullptr) pause();
  }

 private:
  static constexpr int kLooks = 4000;

  static void pause() {
#if defined(__x86_64__)
    __builtin_ia32_pause();
#endif
  }
  void hand(FunctionRef<void()>* work) {
    work_.store(work, std::memory_order_release);
    calls_.fetch_add(1, std::memory_order_release);
    calls_.notify_one();
  }
  void loop(const std::stop_token& stop) {
    unsigned seen = 0;
    for (;;) {
      for (int look = 0; look < kLooks && calls_.load(std::memory_order_acquire) == seen; ++look) pause();
      calls_.wait(seen, std::memory_order_acquire);
      seen = calls_.load(std::memory_order_acquire);
      if (stop.stop_requested()) return;
      (*work_.load(std::memory_order_acquire))();
      work_.store(nullptr, std::memory_order_release);
    }
  }

  std::atomic<FunctionRef<void()>*> work_{nullptr};
  std::atomic<unsigned> calls_{0};
  std::jthread thread_;  ///< last, so that it begins when all else is there
};
#endif

}  // namespace spinaltap::drill
