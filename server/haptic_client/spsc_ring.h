// server/haptic_client/spsc_ring.h - from one thread to one other, without locks or memory of its own making.
#pragma once
#include <array>
#include <atomic>
#include <cstddef>

namespace spinaltap::haptic_client {

template <class T, std::size_t kSize>
class SpscRing {
 public:
  /// By the one who gives. False when it is full.
  bool push(const T& value) {
    const std::size_t end = end_.load(std::memory_order_relaxed);
    if (end - begin_.load(std::memory_order_acquire) == kSize) return false;
    items_[end % kSize] = value;
    end_.store(end + 1, std::memory_order_release);
    return true;
  }
  /// By the one who takes. False when it is empty.
  bool pop(T& into) {
    const std::size_t begin = begin_.load(std::memory_order_relaxed);
    if (begin == end_.load(std::memory_order_acquire)) return false;
    into = items_[begin % kSize];
    begin_.store(begin + 1, std::memory_order_release);
    return true;
  }

 private:
  static_assert((kSize & (kSize - 1)) == 0, "counts wrap around");
  std::array<T, kSize> items_{};
  alignas(64) std::atomic<std::size_t> begin_ = 0;
  alignas(64) std::atomic<std::size_t> end_ = 0;
};

}  // namespace spinaltap::haptic_client
