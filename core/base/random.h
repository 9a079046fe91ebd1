// core/base/random.h - seeded random numbers with the same bits everywhere (std distributions differ by library).
#pragma once
#include <cstdint>

#include "core/base/hash.h"

namespace spinaltap {

/// SplitMix64. One seed, one sequence; pass by reference, never global.
class Random {
 public:
  explicit constexpr Random(std::uint64_t seed) : state_(seed) {}

  constexpr std::uint64_t bits() {
    const std::uint64_t out = mix64(state_);
    state_ += 0x9e3779b97f4a7c15ULL;
    return out;
  }
  /// Uniform in [0, 1), 53 bits.
  constexpr double unit() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  constexpr double uniform(double low, double high) { return low + (high - low) * unit(); }
  /// Uniform in 0 .. count-1. @pre count > 0. The bias is below count / 2^64.
  constexpr std::uint64_t below(std::uint64_t count) { return bits() % count; }
  /// Mean 0, standard deviation 1, by the sum of twelve uniforms: no libm, and never beyond 6.
  constexpr double gaussian() {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += unit();
    return sum;
  }

 private:
  std::uint64_t state_;
};

}  // namespace spinaltap
