// server/haptic_client/device.h - what a driver writes: position in, force out. README.md has an example.
#pragma once
#include <cstdint>
#include <string>

#include "core/base/result.h"
#include "core/base/vec3.h"

namespace spinaltap::haptic_client {

/// What a device is and can bear. Zeros mean "not known"; then nothing is bounded by it.
struct DeviceTraits {
  std::string name;               ///< for people
  double rate_hz = 1000;          ///< of its loop, kLeastRate_hz .. kMostRate_hz
  double max_force_N = 0;         ///< that its motors hold for long; forces are scaled to it, and never longer
  double max_stiffness_N_mm = 0;  ///< the stiffest spring that it renders well
  double damping_N_s_mm = 0;      ///< its own friction at the handle: bounds the spring, with the rate
  double mass_kg = 0;             ///< felt at the handle, the hand's included: bounds the brake; without it, none
  bool renders_torque = false;    ///< it has motors for torque about the tip
  bool paces_itself = false;      ///< read() waits for the device's own tick; else the loop keeps the rate by its clock
};
inline constexpr double kLeastRate_hz = 50, kMostRate_hz = 4000;

/// Where the drill is held; path frame: origin at the entry point, z into the bone along the planned path, mm.
struct HandPose {
  Vec3 tip_mm;
  Vec3 axis{0, 0, 1};    ///< from the shank to the tip; of any length but 0
  bool spinning = true;  ///< the pedal or button of the drill
};

/// A haptic device. All calls but open() come from one thread, the device loop's, and none from elsewhere meanwhile.
/// read() and push() alternate at traits.rate_hz; neither may wait (but for read(), where the device paces itself),
/// allocate or lock for long: what they take is missing from the period.
class Device {
 public:
  Device() = default;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  virtual ~Device() = default;

  /// Once, before all others, on the thread that starts the client. @error whatever keeps it from working, in one line.
  [[nodiscard]] virtual Result<DeviceTraits> open() = 0;
  /// Where the hand is now. @param t_us the loop's clock since it began. @error the device is gone: the loop pushes
  /// nothing any more and ends.
  [[nodiscard]] virtual Result<HandPose> read(std::uint64_t t_us) = 0;
  /// What the motors are to push the hand with from now on, until the next push(): path frame; force in N, torque about
  /// the tip in N mm (zeros where traits say that it renders none). Never longer than max_force_N.
  [[nodiscard]] virtual Result<void> push(const Vec3& force_N, const Vec3& torque_Nmm) = 0;
  /// The drill answers from now on (true), or no more: the network stalled, the force fades to nothing in
  /// DeviceLoop::kFade_s, and nothing that the hand does cuts. For a lamp or a sound.
  virtual void holds(bool) {}
  /// Last of all, after an error too: motors off. Called once for every open() that succeeded.
  virtual void close() noexcept {}
};

}  // namespace spinaltap::haptic_client
