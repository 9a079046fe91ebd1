// core/metrics/breach.h - where the bit came out of the bone; inside metrics only.
#pragma once
#include <span>

#include "core/metrics/metrics.h"

namespace spinaltap::metrics {

struct Breach {
  double breach_mm = 0, plunge_mm = 0;
  Direction direction = Direction::None;
};

/// As Accumulator::finish says. `poses` in the path frame, the deepest last. @pre plan.frame is there.
[[nodiscard]] Breach findBreach(const Plan& plan, std::span<const Pose> poses, const Field& field,
                                int medial_patient_x);

}  // namespace spinaltap::metrics
