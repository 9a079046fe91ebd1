#include "server/haptic_client/virtual_device.h"

#include <algorithm>
#include <cmath>

namespace spinaltap::haptic_client {
namespace {

constexpr double kStep_s = 5e-5;  // of the hand's own dynamics
// Where this machine is later than so many periods, a hand's time stands still: it would have felt another force
// meanwhile than the one that was held.
constexpr double kMostPeriods = 2;

}  // namespace

VirtualDevice::VirtualDevice(const VirtualHand& hand, const DeviceTraits& traits)
    : how_(hand), traits_(traits), hand_(haptics::gripOf(hand.holding)) {
  if (traits_.name.empty()) traits_.name = "simulated hand, " + std::string(haptics::nameOf(hand.holding));
  if (!(traits_.mass_kg > 0)) traits_.mass_kg = haptics::gripOf(hand.holding).mass_kg;
}

Result<DeviceTraits> VirtualDevice::open() {
  hand_.place({0, 0, how_.approach.start_mm});
  return traits_;
}

Result<HandPose> VirtualDevice::read(std::uint64_t t_us) {
  const double passed_s =
      t_us_ ? std::min(1e-6 * static_cast<double>(t_us - *t_us_), kMostPeriods / traits_.rate_hz) : 0.0;
  t_us_ = t_us;
  if (held_) {
    const int steps = std::max(1, static_cast<int>(std::lround(passed_s / kStep_s)));
    const double step_s = passed_s / steps;
    for (int i = 0; i < steps && step_s > 0; ++i) {
      course_s_ += step_s;
      hand_.step(haptics::meantAt(how_.holding, how_.approach, course_s_), {}, force_N_, step_s);
    }
  }
  return HandPose{hand_.at_mm(), {0, 0, 1}, how_.spinning};
}

Result<void> VirtualDevice::push(const Vec3& force_N, const Vec3&) {
  force_N_ = force_N;
  return {};
}

void VirtualDevice::holds(bool held) {
  held_ = held;
  hand_.place(hand_.at_mm());
}

}  // namespace spinaltap::haptic_client
