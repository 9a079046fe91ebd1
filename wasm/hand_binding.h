// wasm/hand_binding.h - a simulated hand that holds the drill, as JavaScript sees it: it pushes along the drill as hard
// as it is told, and across it follows where it aims.
#pragma once
#include "core/haptics/hand.h"

namespace spinaltap::wasm {

/// Two of the core's hands, for a grip that is soft one way and stiff the other: along the drill there is no spring,
/// only mass, damper and push; across it a spring pulls to the aim.
class HandBinding {
 public:
  /// A value that is not above 0 (or, for the damping and the spring, below 0), or not finite, becomes the default's.
  HandBinding(double mass_kg, double damping_N_s_mm, double across_N_mm);

  void place(const Vec3& at_mm);
  /// One step of simulated time.
  /// @param axis unit vector, shank to tip; push_N along it, deeper is positive; aim_mm a point on the line that the
  ///        hand means to hold; reaction_N what the drill pushes back with, path frame.
  void step(double seconds, const Vec3& axis, double push_N, const Vec3& aim_mm, const Vec3& reaction_N);

  [[nodiscard]] Vec3 at() const { return along_.at_mm() + across_.at_mm(); }
  [[nodiscard]] Vec3 velocity() const { return along_.velocity_mm_s() + across_.velocity_mm_s(); }

 private:
  haptics::Hand along_, across_;  ///< where both moved to adds up
};

}  // namespace spinaltap::wasm
