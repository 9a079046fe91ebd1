// core/tradeoff/swept_volume.h - how much a bit sweeps, pose by pose, without any lattice: the truth that what a drill
// removes is held against.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "core/drill/engine.h"
#include "core/plan/path.h"

namespace spinaltap::tradeoff {

/// Where the bit gets below the plane z = top_mm (path frame): no farther from the path's axis, no deeper.
struct Reach {
  double radius_mm = 0, depth_mm = 0;
};
/// An upper bound, wider than need be by less than the bit's radius times 1 - cos(tilt).
/// @pre as sweptVolume.
[[nodiscard]] Reach reachOf(const plan::Bit& bit, std::span<const drill::BitPose> poses, double top_mm);

struct SweptOptions {
  int columns = 4181;  ///< of one estimate; taken up to the next Fibonacci number
  int estimates = 8;   ///< each with its columns shifted at random; at least 2, whose spread gives the error
  std::uint64_t seed = 2002;
  unsigned threads = 0;  ///< 0: all; the same bits from any number
};

struct Swept {
  std::vector<double> each_mm3;  ///< what pose n covers that none before it did, below the plane
  double total_mm3 = 0;
  double error_mm3 = 0;       ///< standard error of the total
  double each_error_mm3 = 0;  ///< standard error of a pose's share, RMS over the poses
};

/// The union of the bits (closed sets, without the predicate's touch) at these poses, cut off at z = top_mm, by
/// columns along z. On one column every pose's stretch is exact (a line through a cone and a cylinder), and so is their
/// union; the sum over columns is a Fibonacci lattice in (radius squared, angle), the former folded so that it is
/// periodic too, shifted at random (Sloan and Joe, "Lattice Methods for Multiple Integration", 1994). Nothing is shared
/// with what is measured by it: no lattice of points, no predicate.
/// @pre at least one pose; axes of unit length with z >= 0.2 (tilted up to 78 degrees), all finite; a valid bit.
/// @cost some 20 ns for each pose and column.
[[nodiscard]] Swept sweptVolume(const plan::Bit& bit, std::span<const drill::BitPose> poses, double top_mm,
                                const SweptOptions& options = {});

}  // namespace spinaltap::tradeoff
