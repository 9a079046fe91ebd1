// core/drill/simd_hand_out.h - the numbers and densities of a word's points. Private to core/drill.
#pragma once
#include <cstdint>

namespace spinaltap::drill {

struct HandedOut {
  std::uint32_t count, density_sum;
};

/// Writes first + b to `to` for each set bit b, ascending, and adds up density[b]. Bits in a row cost little more than
/// one. @pre density[0 .. 127] can be read, and to[0 .. 127] can be written.
[[nodiscard]] HandedOut handOut(std::uint64_t bits, std::uint32_t first, const std::uint16_t* density,
                                std::uint32_t* to);

/// The same of `count` points in a row: writes first, first + 1, .. and adds up density[0 .. count-1].
/// @pre 64 more of either can be read or written; count < 65536.
[[nodiscard]] std::uint32_t handOutRow(std::uint32_t count, std::uint32_t first, const std::uint16_t* density,
                                       std::uint32_t* to);

}  // namespace spinaltap::drill
