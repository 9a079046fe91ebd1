// core/haptics/hand.h - a simulated hand that holds the drill: what tests, the virtual device and the trade-off push
// with. A mass on a spring and a damper that follows where the trainee means to be, with what the trainee pushes on
// top. Values: relaxed and tense grips of a stylus, after J. E. Speich, L. Shao and M. Goldfarb, Mechatronics 15
// (2005), 1127-1142 (some hundred grams; 2-30 N s/m; 60-1000 N/m).
#pragma once
#include "core/base/vec3.h"

namespace spinaltap::haptics {

struct Grip {
  double mass_kg = 0.15;
  double damping_N_s_mm = 0.003;
  double stiffness_N_mm = 0.1;  ///< towards where the hand means to be; 0: it only pushes
};
[[nodiscard]] constexpr Grip relaxedGrip() { return {0.15, 0.003, 0.1}; }
[[nodiscard]] constexpr Grip tenseGrip() { return {0.25, 0.02, 1.0}; }
/// An arm that leans on the drill: what it means to reach lies far ahead, so it pushes nearly alike all the way.
[[nodiscard]] constexpr Grip leaningGrip() { return {0.25, 0.01, 0.5}; }

class Hand {
 public:
  explicit Hand(const Grip& grip) : grip_(grip) {}

  /// Implicit in the damper and the spring, so that it makes no energy of its own at any step.
  /// @param meant_mm where it means to be; push_N on top of that; reaction_N what the device pushes back with.
  void step(const Vec3& meant_mm, const Vec3& push_N, const Vec3& reaction_N, double seconds) {
    const double per_kg = 1000.0 / grip_.mass_kg;  // mm/s2 for a newton
    const Vec3 force_N = (meant_mm - at_mm_) * grip_.stiffness_N_mm + push_N + reaction_N;
    const double brake = grip_.damping_N_s_mm + grip_.stiffness_N_mm * seconds;
    velocity_mm_s_ = (velocity_mm_s_ + force_N * (per_kg * seconds)) / (1.0 + brake * per_kg * seconds);
    at_mm_ += velocity_mm_s_ * seconds;
  }
  void place(const Vec3& at_mm) { at_mm_ = at_mm, velocity_mm_s_ = {}; }

  [[nodiscard]] const Vec3& at_mm() const { return at_mm_; }
  [[nodiscard]] const Vec3& velocity_mm_s() const { return velocity_mm_s_; }

 private:
  Grip grip_;
  Vec3 at_mm_, velocity_mm_s_;
};

}  // namespace spinaltap::haptics
