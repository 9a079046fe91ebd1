// server/ws/loop_metrics.h - what the live loops measure of themselves, as Prometheus reads it.
#pragma once
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <span>
#include <string>

namespace spinaltap::ws {

/// Counts in buckets. Written by one thread, read by any.
class Histogram {
 public:
  /// Upper bounds, seconds; one more bucket holds what is above them all.
  static constexpr std::array<double, 14> kBounds_s{1e-6,   2e-6,   5e-6, 10e-6, 20e-6, 50e-6, 100e-6,
                                                    200e-6, 500e-6, 1e-3, 2e-3,  5e-3,  20e-3, 100e-3};
  void add(std::chrono::steady_clock::duration time, std::uint64_t times = 1);
  [[nodiscard]] std::uint64_t count(std::size_t bucket) const {
    return counts_[bucket].load(std::memory_order_relaxed);
  }
  [[nodiscard]] double sum_s() const { return static_cast<double>(sum_ns_.load(std::memory_order_relaxed)) * 1e-9; }

 private:
  std::array<std::atomic<std::uint64_t>, kBounds_s.size() + 1> counts_{};
  std::atomic<std::uint64_t> sum_ns_ = 0;
};

/// Of one loop. Counters only ever grow; gauges are set once a turn.
struct LoopMetrics {
  Histogram cycle;   ///< drilling and recording one pose
  Histogram answer;  ///< from the turn that read a batch to its answer being handed to the system
  Histogram jitter;  ///< how far the time between two batches differs from that of the device's clock
  std::atomic<std::uint64_t> cycles{0}, refused{0}, late{0}, coalesced{0}, overloads{0}, cut_loose{0}, resumed{0};
  std::atomic<std::uint64_t> live{0}, paused{0}, watching{0};
  std::atomic<std::uint64_t> poses_waiting{0}, input_bytes_waiting{0}, feedback_waiting{0}, disk_bytes_waiting{0};
};

/// Prometheus' text format 0.0.4, all loops together.
[[nodiscard]] std::string prometheusText(std::span<const LoopMetrics* const> loops, bool realtime);

}  // namespace spinaltap::ws
