// core/base/parallel.h - one loop on several threads. Work is handed out in blocks whose bounds depend on the loop
// alone, never on the number of threads, so whoever writes only to its own block gets the same bits from any number of
// them.
#pragma once
#include <algorithm>
#include <cstddef>
#ifndef __EMSCRIPTEN__
#include <atomic>
#include <system_error>
#include <thread>
#include <vector>
#endif

namespace spinaltap {

/// What `threads = 0` means everywhere: as many as the machine runs at once; 1 in the browser.
[[nodiscard]] inline unsigned threadsOr(unsigned threads) {
#ifdef __EMSCRIPTEN__
  (void)threads;
  return 1;
#else
  return threads != 0 ? threads : std::max(1U, std::thread::hardware_concurrency());
#endif
}

/// Calls work(begin, end) for [0, block), [block, 2 block), ... up to count, on up to `threads` threads (0: threadsOr),
/// the caller's among them. Returns when all is done. A thread that cannot be had is done without.
/// @pre block > 0; work does not throw. @cost some 20 us for each thread beyond the caller's.
template <class Work>
void parallelBlocks(std::size_t count, std::size_t block, unsigned threads, const Work& work) {
  const std::size_t blocks = (count + block - 1) / block;
#ifdef __EMSCRIPTEN__
  (void)threads;
  for (std::size_t b = 0; b < blocks; ++b) work(b * block, std::min(count, (b + 1) * block));
#else
  std::atomic<std::size_t> next{0};
  const auto take = [&] {
    for (std::size_t b = next++; b < blocks; b = next++) work(b * block, std::min(count, (b + 1) * block));
  };
  std::vector<std::jthread> others;
  const std::size_t wanted = std::min<std::size_t>(threadsOr(threads), blocks);
  others.reserve(wanted);
  for (std::size_t n = 1; n < wanted; ++n) {
    try {
      others.emplace_back(take);
    } catch (const std::system_error&) {
      break;
    }
  }
  take();
#endif
}

}  // namespace spinaltap
