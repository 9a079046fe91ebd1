#include "core/haptics/holding.h"

#include "core/base/dmath.h"

namespace spinaltap::haptics {
namespace {

constexpr double kLeanTo_mm = 50, kTremor_mm = 0.2, kTremor_Hz = 9;

}  // namespace

std::string_view nameOf(Holding holding) {
  constexpr std::array<std::string_view, 4> kNames{"relaxed", "tense", "leaning", "trembling"};
  return kNames[static_cast<std::size_t>(holding)];
}

Grip gripOf(Holding holding) {
  return holding == Holding::Tense ? tenseGrip() : holding == Holding::Leaning ? leaningGrip() : relaxedGrip();
}

Vec3 meantAt(Holding holding, const Approach& approach, double t_s) {
  if (holding == Holding::Leaning) return {0, 0, kLeanTo_mm};
  const double ahead_mm = approach.start_mm + approach.feed_mm_s * t_s;
  if (holding != Holding::Trembling) return {0, 0, ahead_mm};
  const SinCos at = sinCos(2 * kPi * kTremor_Hz * t_s);
  return {kTremor_mm * at.sin, kTremor_mm * at.cos, ahead_mm + kTremor_mm * at.sin};
}

}  // namespace spinaltap::haptics
