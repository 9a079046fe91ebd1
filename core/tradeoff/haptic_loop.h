// core/tradeoff/haptic_loop.h - hand, device, network and session in one closed loop, to see what rate, delay and
// extrapolation do to the force and to stability. Time is simulated: the same case gives the same numbers everywhere.
#pragma once
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/haptics/holding.h"
#include "core/haptics/proxy.h"

namespace spinaltap::tradeoff {

/// What is drilled: solid cortex, solid cancellous bone, or a vertebra's layers and out of the far side.
enum class Bone : std::uint8_t { Cortex, Cancellous, ThroughTheWall };
/// Who holds the drill, at haptics::Approach's feed.
using haptics::Holding;
using haptics::nameOf;
[[nodiscard]] std::string_view nameOf(Bone bone);

/// A course begins once the session has answered: whoever comes to bone has been in touch before.
struct HapticCase {
  Bone bone = Bone::Cancellous;
  Holding holding = Holding::Relaxed;
  double rate_hz = 1000;    ///< of the device's loop; a pose is sent each time
  double delay_ms = 0;      ///< there and back, half each way
  double jitter_ms = 0;     ///< each message later by a uniform share of it: with more than a period, they overtake
  double loss = 0;          ///< of messages, each way
  bool extrapolate = true;  ///< feel the local model (local_model.h), not the last answer
  bool guard = true;        ///< passivity.h at the device
  bool spinning = true;
  haptics::Coupling coupling;
  double seconds = 3;
  std::uint64_t seed = 1;
};

struct HapticResult {
  double given_mJ = 0;      ///< the most that the port had given to the hand beyond what it took, at any time
  double overshoot_mm = 0;  ///< deepest of the bit, beyond the reference's deepest
  double force_rms_N = 0;   ///< difference to the reference at 20 kHz without delay
  double force_mean_N = 0;  ///< of the reference
  double swing_mm = 0;      ///< peak to peak of the hand about its own mean course (0.1 s), in the last quarter
  double depth_mm = 0;
  std::uint64_t late = 0, lost = 0;  ///< poses that the session refused because newer ones had come; lost on the way
};

/// What a hand drills with at a rate: the default, or what its damping can hold.
[[nodiscard]] haptics::Coupling couplingOf(Holding holding, double rate_hz);

/// The hand's course in one case, at 1 kHz, for plots: t_s, depth_mm, force_N.
struct HapticTrace {
  std::vector<double> t_s, depth_mm, force_N;
};

/// Hand, force and depth, 20,000 times a second.
struct Course {
  std::vector<double> at_mm, force_N, depth_mm;
};
/// What the case's hand would feel at 20 kHz without network, guard or extrapolation.
/// @error as session::Session::create. @cost 0.2 s a second.
[[nodiscard]] Result<Course> idealCourse(const HapticCase& haptic_case);

/// @param ideal of a case with the same bone, holding, coupling and time. @error as session::Session::create.
[[nodiscard]] Result<HapticResult> runLoop(const HapticCase& haptic_case, const Course& ideal,
                                           HapticTrace* trace = nullptr);

/// The stiffest coupling, N/mm, with which a relaxed hand that is drawn 3 mm into a wall (a bit that does not turn)
/// comes to rest, as do all less stiff ones: swinging by less than 0.02 mm in the last quarter of 1.5 s. Sought upwards
/// in steps of half, then to 5 %; 0 when even 0.05 N/mm swings, 200 when nothing does.
[[nodiscard]] Result<double> stiffestStable_N_mm(HapticCase haptic_case);

}  // namespace spinaltap::tradeoff
