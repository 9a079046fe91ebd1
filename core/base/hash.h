// core/base/hash.h - 64-bit mixing for state hashes. Not cryptographic: files are named by SHA-256 in server/store.
#pragma once
#include <cstdint>
#include <cstring>

namespace spinaltap {

/// A bijection of 64 bits with good avalanche (the finaliser of SplitMix64, Steele et al., OOPSLA 2014).
[[nodiscard]] constexpr std::uint64_t mix64(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// Order-dependent combination.
[[nodiscard]] constexpr std::uint64_t combine(std::uint64_t hash, std::uint64_t value) {
  return mix64(hash ^ mix64(value));
}

/// The bits of a double, with -0 counted as +0 so that equal numbers hash alike. (libc++ of old lacks bit_cast.)
[[nodiscard]] inline std::uint64_t bitsOf(double value) {
  value += 0.0;
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

}  // namespace spinaltap
