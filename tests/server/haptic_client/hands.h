// tests/server/haptic_client/hands.h - devices that tests hold: hands that do as they are told, and fail when told.
#pragma once
#include <functional>

#include "server/haptic_client/virtual_device.h"

namespace spinaltap::test {

/// Goes where `course` says, whatever it feels; remembers what it felt.
class ScriptedDevice : public haptic_client::Device {
 public:
  std::function<Vec3(double t_s)> course;
  haptic_client::DeviceTraits traits;
  std::uint64_t fail_at_us = UINT64_MAX;
  Vec3 force_N, torque_Nmm, axis{0, 0, 1};
  bool held = false;
  int closed = 0;

  Result<haptic_client::DeviceTraits> open() override { return traits; }
  Result<haptic_client::HandPose> read(std::uint64_t t_us) override {
    if (t_us >= fail_at_us) return fail(ErrorCode::Io, "somebody pulled the plug");
    return haptic_client::HandPose{course(1e-6 * static_cast<double>(t_us)), axis, true};
  }
  Result<void> push(const Vec3& force, const Vec3& torque) override {
    force_N = force, torque_Nmm = torque;
    return {};
  }
  void holds(bool is_held) override { held = is_held; }
  void close() noexcept override { ++closed; }
};

}  // namespace spinaltap::test
