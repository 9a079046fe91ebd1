#include "core/haptics/thrust.h"

namespace spinaltap::haptics {
namespace {

// Below this the force is nothing that a hand or a device could tell from none; ending the decay here keeps it out of
// denormal numbers, which are slow.
constexpr double kNothing_N = 1e-9;

}  // namespace

double Thrust::step(double removed_mg, std::uint64_t elapsed_us) {
  waiting_mg_ += removed_mg;
  if (elapsed_us == 0) return thrust_N_;
  // Implicit Euler: (F1 - F0) / dt = (k m / dt - F1) / tau. Summed over any steps, the impulse is k times the mass
  // less tau (F_end - F_begin): how the motion was cut into cycles does not matter.
  const double ratio = static_cast<double>(elapsed_us) * 1e-6 / kSmoothing_s;
  thrust_N_ = (thrust_N_ + kNewtonsPerMgPerS * waiting_mg_ / kSmoothing_s) / (1.0 + ratio);
  waiting_mg_ = 0;
  if (thrust_N_ < kNothing_N) thrust_N_ = 0;
  return thrust_N_;
}

}  // namespace spinaltap::haptics
