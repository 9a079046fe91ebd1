// core/haptics/port.h - where a device meets the drill: its position in, the force of its motors out. The client's own
// bit (local_model.h), scaled and limited to the device, under a passivity guard (passivity.h). Knows no network and no
// clock: who owns it says when, and hands on what the server answers.
#pragma once
#include <algorithm>

#include "core/haptics/local_model.h"
#include "core/haptics/passivity.h"

namespace spinaltap::haptics {

/// What a device can bear.
struct PortLimits {
  double force_scale = 1;        ///< > 0: the bone's force times this is the device's
  double max_force_N = 0;        ///< 0: no limit
  double most_brake_N_s_mm = 0;  ///< PassivityGuard; half of m / T is safe
  bool renders_torque = false;   ///< else torque gives no energy, whatever is asked of it
};

class Port {
 public:
  /// What the device shall push with until the next step; path frame.
  struct Felt {
    Vec3 force_N, torque_Nmm;  ///< on the hand; the torque about the tip
    bool limited = false;      ///< shortened to the device's maximum, force and torque together
  };

  Port(const Coupling& coupling, const Drive& drive, const PortLimits& limits)
      : bit_(coupling, drive), guard_(limits.most_brake_N_s_mm, limits.max_force_N), limits_(limits) {}

  /// The drill is taken up: as LocalBit::place. What was given and taken before still counts.
  void place(const Rod& hand) { bit_.place(hand); }
  /// Moves the client's bit on by one period: what the bone asks, neither scaled nor limited; tool frame of rod().
  Reaction move(std::uint32_t seq, const Rod& hand, double seconds, bool spinning) {
    return bit_.step(seq, hand, seconds, spinning, -guard_.given_mJ() / limits_.force_scale);
  }
  /// The same as the device feels it. @param device where the device is: the hand's rod, or what it is mapped from.
  Felt push(const Rod& device, const Vec3& bone_force_N, const Vec3& bone_torque_Nmm, double seconds) {
    Felt felt{bone_force_N * limits_.force_scale, bone_torque_Nmm * limits_.force_scale};
    const double length = norm(felt.force_N);
    felt.limited = limits_.max_force_N > 0 && length > limits_.max_force_N;
    if (felt.limited) {
      felt.force_N *= limits_.max_force_N / length;
      felt.torque_Nmm *= limits_.max_force_N / length;
    }
    if (!limits_.renders_torque) felt.torque_Nmm = {};
    // An axis that turned from a to b turned by a x b, up to the cube of it.
    const double by_torque_mJ = begun_ ? dot(held_Nmm_, cross(axis_, device.axis)) : 0.0;
    held_Nmm_ = felt.torque_Nmm, axis_ = device.axis, begun_ = true;
    felt.force_N = guard_.step(device.tip_mm, felt.force_N, seconds, by_torque_mJ);
    return felt;
  }
  void learn(std::uint32_t seq, const LocalModel& model) { bit_.learn(seq, model); }

  [[nodiscard]] const Rod& rod() const { return bit_.rod(); }
  [[nodiscard]] const PassivityGuard& guard() const { return guard_; }
  [[nodiscard]] const PortLimits& limits() const { return limits_; }

 private:
  LocalBit bit_;
  PassivityGuard guard_;
  PortLimits limits_;
  Vec3 held_Nmm_, axis_;
  bool begun_ = false;
};

}  // namespace spinaltap::haptics
