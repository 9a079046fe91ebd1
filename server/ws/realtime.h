// server/ws/realtime.h - what the operating system grants to live loops, and a plain line that says so.
#pragma once
#include <span>
#include <string>
#include <thread>

namespace spinaltap::ws {

struct RealtimeGrant {
  bool fifo = false;  ///< SCHED_FIFO for every thread asked for
  bool locked = false;
  bool pinned = false;
  std::string line;  ///< "SCHED_FIFO granted, memory locked, live loops on CPU 1"
};

/// Asks for SCHED_FIFO and a CPU of its own for each thread, and for locked memory. What is refused is left as it was.
[[nodiscard]] RealtimeGrant askForRealtime(std::span<const std::thread::native_handle_type> threads);

/// SCHED_FIFO alone. @return one line; `granted` only ever becomes true.
[[nodiscard]] std::string askForFifo(std::span<const std::thread::native_handle_type> threads, bool& granted);

/// This thread, and those that it starts, yield to the live loops wherever they want the same core.
void yieldToLiveLoops();

}  // namespace spinaltap::ws
