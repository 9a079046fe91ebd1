// core/haptics/cutting.h - what bone asks of a turning bit: thrust and torque over feed, as one law for tip and sides.
// The numbers, their sources and the reference measurement: constants.h.
// After: K. L. Wiggins and S. Malkin, "Drilling of bone", J. Biomech. 9 (1976), 553-559 (thrust, torque and specific
// cutting energy over feed per revolution); T. MacAvelia et al., J. Biomech. Eng. 134 (2012), 124503 (values).
#pragma once
#include <cstdint>

#include "core/haptics/constants.h"

namespace spinaltap::haptics {

/// What turns the bit, and how wide it is.
struct Drive {
  double speed_rpm = kSpeed_rpm;  ///< of a bit that turns, > 0
  double diameter_mm = 3.0;
  friend bool operator==(const Drive&, const Drive&) = default;
};

/// Hardness of bone: 1 for the reference cortex, 0 where no bone is. @param density_mg_cm3 apparent.
[[nodiscard]] constexpr double hardness(double density_mg_cm3) {
  const double share = density_mg_cm3 / kCortex_mg_cm3;
  return share * share;
}

/// Resistance to an advance: threshold + slope * velocity, for velocity > 0. Both are never negative.
struct Resistance {
  double threshold_N = 0;   ///< below this nothing moves
  double slope_N_s_mm = 0;  ///< per mm/s
  bool wall = false;        ///< nothing moves at all
};

/// @param area_mm2 frontal area that meets bone, each part weighted with its hardness.
[[nodiscard]] Resistance tipResistance(double area_mm2, const Drive& drive, bool spinning);
/// @param area_mm2 of a part of the side, projected onto its normal, weighted with hardness.
[[nodiscard]] Resistance sideResistance(double area_mm2, const Drive& drive, bool spinning);

/// Velocity of a massless body that is pulled with `pull_N - give_N_s_mm * velocity` against a resistance: >= 0, and 0
/// where the pull does not reach the threshold. Implicit: no step is too long. @pre give_N_s_mm > 0.
[[nodiscard]] double advance_mm_s(const Resistance& resistance, double pull_N, double give_N_s_mm);

/// Torque about the axis that the bone asks for, N mm: specific cutting energy times the volume cut a turn.
/// @param feed_mm_s >= 0.
[[nodiscard]] double torque_Nmm(double area_mm2, const Drive& drive, double feed_mm_s);

}  // namespace spinaltap::haptics
