// server/haptic_client/virtual_device.h - a device without hardware: a simulated hand (core/haptics/hand.h) that drills
// and feels. Also what a driver looks like.
#pragma once
#include <optional>

#include "core/haptics/holding.h"
#include "server/haptic_client/device.h"

namespace spinaltap::haptic_client {

struct VirtualHand {
  haptics::Holding holding = haptics::Holding::Tense;
  haptics::Approach approach;
  bool spinning = true;
};

class VirtualDevice final : public Device {
 public:
  /// @param traits what it pretends to be; without a mass, the hand's own.
  VirtualDevice(const VirtualHand& hand, const DeviceTraits& traits);

  [[nodiscard]] Result<DeviceTraits> open() override;
  [[nodiscard]] Result<HandPose> read(std::uint64_t t_us) override;
  [[nodiscard]] Result<void> push(const Vec3& force_N, const Vec3& torque_Nmm) override;
  /// A hand that feels its drill go limp keeps still until it is back.
  void holds(bool held) override;

 private:
  VirtualHand how_;
  DeviceTraits traits_;
  haptics::Hand hand_;
  Vec3 force_N_;
  bool held_ = false;
  double course_s_ = 0;  ///< since the hand set off, pauses left out
  std::optional<std::uint64_t> t_us_;
};

}  // namespace spinaltap::haptic_client
