// core/haptics/thrust.h - thrust in newtons from the mass cut away, by a simple stated law.
// haptics knows no bone: it takes masses and times, never points.
#pragma once
#include <cstdint>

namespace spinaltap::haptics {

/// Thrust is proportional to the rate at which mass is cut, smoothed by one pole:
///   F' = (kNewtonsPerMgPerS * (mass rate) - F) / kSmoothing_s,   integrated exactly implicit, so stable at any step.
/// With 2 N per mg/s, a 3 mm bit at 1 mm/s needs about 4 N in cancellous bone of 300 mg/cm3 and about 20 N in a cortex
/// of 1400 mg/cm3, within the 0.6-30 N measured in porcine vertebrae (Powers, quoted by Orelaja 2020, table 6).
inline constexpr double kNewtonsPerMgPerS = 2.0;
inline constexpr double kSmoothing_s = 0.020;

class Thrust {
 public:
  /// @param removed_mg  mass cut since the last call, >= 0.
  /// @param elapsed_us  time since the last call; 0 leaves the mass for the next call.
  /// @return thrust in N, >= 0.
  double step(double removed_mg, std::uint64_t elapsed_us);
  [[nodiscard]] double thrust_N() const { return thrust_N_; }

 private:
  double thrust_N_ = 0;
  double waiting_mg_ = 0;
};

}  // namespace spinaltap::haptics
