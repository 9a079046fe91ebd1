// core/haptics/holding.h - who holds the drill: four simulated trainees, each a grip (hand.h) and where it means to be.
#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include "core/haptics/hand.h"

namespace spinaltap::haptics {

/// Relaxed and Tense follow a feed; Leaning pushes with 25 N that fade out 50 mm beyond the entry; Trembling is
/// relaxed, with a tremor of 0.2 mm at 9 Hz.
enum class Holding : std::uint8_t { Relaxed, Tense, Leaning, Trembling };
inline constexpr std::array kHoldings{Holding::Relaxed, Holding::Tense, Holding::Leaning, Holding::Trembling};

[[nodiscard]] std::string_view nameOf(Holding holding);
[[nodiscard]] Grip gripOf(Holding holding);

/// How it goes into the bone: along the path, from `start_mm` before or beyond the entry.
struct Approach {
  double start_mm = -0.5;
  double feed_mm_s = 2;
};
/// Where the hand means to be, path frame. @param t_s since it began.
[[nodiscard]] Vec3 meantAt(Holding holding, const Approach& approach, double t_s);

}  // namespace spinaltap::haptics
