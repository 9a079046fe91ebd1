// core/haptics/passivity.h - watches the port between device and hand, and takes back what it gave too much.
// After: B. Hannaford and J.-H. Ryu, "Time-domain passivity control of haptic interfaces", IEEE Trans. Robotics and
// Automation 18 (2002), 1-10; the exact sum for a held force after J.-H. Ryu et al., "Time domain passivity control
// with reference energy following", IEEE Trans. Control Systems Technology 13 (2005).
#pragma once
#include <algorithm>

#include "core/base/vec3.h"

namespace spinaltap::haptics {

/// A force is held from one call to the next, so the energy that it gave is its product with the way: exactly, however
/// the hand moved in between. What was given beyond what was taken is braked away over the next steps.
class PassivityGuard {
 public:
  /// @param most_damping_N_s_mm the strongest brake that the device can hold without swinging by itself; for a loop of
  ///        period T and a device (with hand) of mass m, half of m / T is safe.
  /// @param max_force_N what the device can push with, the brake included; 0: no limit.
  explicit PassivityGuard(double most_damping_N_s_mm, double max_force_N = 0)
      : most_N_s_mm_(most_damping_N_s_mm), max_N_(max_force_N) {}

  /// Called at the device's rate. @param at_mm where the device is now; wanted_N what it is to push with from now on.
  /// @param otherwise_mJ what else the device gave since the last call: a torque.
  /// @return what it shall push with. @pre seconds > 0.
  Vec3 step(const Vec3& at_mm, const Vec3& wanted_N, double seconds, double otherwise_mJ = 0) {
    const Vec3 way = begun_ ? at_mm - before_mm_ : Vec3{};
    given_mJ_ += dot(held_N_, way) + otherwise_mJ;
    most_given_mJ_ = std::max(most_given_mJ_, given_mJ_);
    held_N_ = wanted_N;
    const double square = dot(way, way);
    if (given_mJ_ > 0 && square > 0) {
      // At the velocity of the last step, the next one takes back all of it, or as much as the brake may.
      const double brake = std::min(given_mJ_ * seconds / square, most_N_s_mm_);
      held_N_ -= way * (brake / seconds);
      const double length = norm(held_N_);
      if (max_N_ > 0 && length > max_N_) held_N_ *= max_N_ / length;
      ++braked_;
    }
    before_mm_ = at_mm;
    begun_ = true;
    return held_N_;
  }

  /// Net energy given to the hand so far (N mm = mJ): negative when the hand put in more.
  [[nodiscard]] double given_mJ() const { return given_mJ_; }
  [[nodiscard]] double mostGiven_mJ() const { return most_given_mJ_; }
  [[nodiscard]] unsigned long long braked() const { return braked_; }

 private:
  double most_N_s_mm_, max_N_, given_mJ_ = 0, most_given_mJ_ = 0;
  Vec3 before_mm_, held_N_;
  bool begun_ = false;
  unsigned long long braked_ = 0;
};

}  // namespace spinaltap::haptics
