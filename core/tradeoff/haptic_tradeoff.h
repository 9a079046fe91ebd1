// core/tradeoff/haptic_tradeoff.h - the closed loop (haptic_loop.h) in every bone and hand, at several rates and over
// several networks, with the last answer's force and with extrapolation: force error, energy, stiffest coupling.
#pragma once
#include <functional>
#include <vector>

#include "core/tradeoff/haptic_loop.h"

namespace spinaltap::tradeoff {

struct Network {
  double delay_ms = 0, jitter_ms = 0, loss = 0;  ///< as HapticCase
};

struct HapticGrid {
  std::vector<double> rates_hz{300, 500, 1000, 4000};
  std::vector<double> delays_ms{0, 1, 5, 20, 50};
  double jitter_ms = 4, loss = 0.05;  ///< of one network more, which has the middle one of the delays; both 0: none
  double seconds = 3;                 ///< of drilling, each case
  unsigned threads = 0;               ///< 0: all; the same figures from any number
};

/// Most rates and delays of a grid: as many lines and places as a chart holds.
inline constexpr std::size_t kMostRates = 6, kMostDelays = 12;

/// @error InvalidArgument: no rate or delay, or too many; rates outside 50 to 20,000 Hz, delays outside 0 to 1000 ms,
///        jitter outside 0 to 1000 ms, loss outside 0 to 0.9, seconds outside 0.5 to 10; one rate or delay twice.
[[nodiscard]] Result<void> checkGrid(const HapticGrid& grid);

/// The delays, and the one that jitters and loses, last. @pre checkGrid.
[[nodiscard]] std::vector<Network> networksOf(const HapticGrid& grid);

struct HapticMeasured {
  HapticCase setting;
  HapticResult result;
  /// RMS over the reference's mean; 0 where the hand met nothing.
  [[nodiscard]] double errorShare() const {
    return result.force_mean_N > 0 ? result.force_rms_N / result.force_mean_N : 0;
  }
};
struct StiffestMeasured {
  HapticCase setting;  ///< the hand, the bone and the time are stiffestStable_N_mm's own
  double stiffest_N_mm = 0;
  double theory_N_mm = 0;  ///< 2 b / T of the relaxed hand's damping b: a sampled wall, without delay or guard
};

/// progress(share of the work that is done); may be empty; called by the caller's thread.
using HapticProgress = std::function<void(double)>;

/// By bone, holding, rate, network, and as answered before extrapolated; always with the guard and couplingOf.
/// @error as checkGrid, session::Session::create.
/// @cost 0.05 s of a thread a case and 0.5 s a bone, holding and coupling.
[[nodiscard]] Result<std::vector<HapticMeasured>> measureHaptics(const HapticGrid& grid,
                                                                 const HapticProgress& progress = {});

/// By rate, network, as answered before extrapolated, without the guard before with it.
/// @error as measureHaptics. @cost 0.4 s of a thread each.
[[nodiscard]] Result<std::vector<StiffestMeasured>> measureStiffest(const HapticGrid& grid,
                                                                    const HapticProgress& progress = {});

/// Force over time in one case, a sample a millisecond: pushing back, in newtons.
struct ForceCourses {
  HapticTrace answered, extrapolated;
  std::vector<double> ideal_N;  ///< at the same times
};
/// @error as session::Session::create.
[[nodiscard]] Result<ForceCourses> forceCourses(HapticCase haptic_case);

}  // namespace spinaltap::tradeoff
