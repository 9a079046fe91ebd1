#include "core/haptics/cutting.h"

#include <algorithm>

#include "core/base/dmath.h"

namespace spinaltap::haptics {
namespace {

Resistance resistance(double area_mm2, const Drive& drive, bool spinning, double chisel, double lips) {
  if (!(area_mm2 > 0)) return {};
  if (!spinning) return {0, 0, true};
  const double turns_per_s = drive.speed_rpm / 60.0;
  return {area_mm2 * chisel, area_mm2 * lips / (drive.diameter_mm * turns_per_s), false};
}

}  // namespace

Resistance tipResistance(double area_mm2, const Drive& drive, bool spinning) {
  return resistance(area_mm2, drive, spinning, kChisel_N_mm2, kLips_N_mm2);
}

Resistance sideResistance(double area_mm2, const Drive& drive, bool spinning) {
  return resistance(area_mm2, drive, spinning, kSideChisel * kChisel_N_mm2, kSideLips * kLips_N_mm2);
}

double advance_mm_s(const Resistance& resistance, double pull_N, double give_N_s_mm) {
  if (resistance.wall) return 0;
  return std::max(0.0, pull_N - resistance.threshold_N) / (give_N_s_mm + resistance.slope_N_s_mm);
}

double torque_Nmm(double area_mm2, const Drive& drive, double feed_mm_s) {
  const double feed_per_turn_mm = feed_mm_s / (drive.speed_rpm / 60.0);
  return 1000.0 * kCutting_J_mm3 * area_mm2 * feed_per_turn_mm / (2.0 * kPi);  // 1 J/mm3 = 1000 N/mm2
}

}  // namespace spinaltap::haptics
