// core/drill/reachable.h - the points of a lattice that a bit can reach, as ranges: a superset of those inside, by
// bounds.h. Private to core/drill.
#pragma once
#include <algorithm>

#include "core/drill/bounds.h"

namespace spinaltap::drill {

/// each(disc, first, end) for ranges of points of a disc, numbered as in the disc, until one returns true; returns
/// whether one did.
template <class Each>
bool anyReachable(const point_volume::Lattice& lattice, const BitShape& bit, const BitPose& pose, DiscRange discs,
                  const Each& each) {
  using point_volume::Lattice;
  const int outermost = lattice.rings - 1;
  for (int disc = discs.first; disc <= discs.last; ++disc) {
    const Circle circle = sectionCircle(bit, pose, lattice.discZ_mm(disc));
    if (circle.radius_mm < 0) continue;
    const PolarCircle section = polar(circle);
    const double spacing = lattice.spacing_mm, d = section.distance_mm, radius = section.radius_mm;
    // Rings wholly inside the circle are one run of points.
    const int whole = heldFloor((radius - d) / spacing, outermost);
    if (whole >= 0 && each(disc, 0, Lattice::ringStart(whole + 1))) return true;
    const int last = heldFloor((d + radius) / spacing, outermost);
    for (int ring = std::max(whole + 1, heldCeil((d - radius) / spacing, outermost + 1)); ring <= last; ++ring) {
      const std::uint32_t start = Lattice::ringStart(ring);
      const SlotRange range = ring == 0 ? SlotRange{0, 1} : slotsInside(section, ring, spacing);
      const int slots = Lattice::slotsOf(ring), end = range.first + range.count;
      const auto at = [start](int slot) { return start + static_cast<std::uint32_t>(slot); };
      if (end > slots && each(disc, at(0), at(end - slots))) return true;
      if (each(disc, at(range.first), at(std::min(end, slots)))) return true;
    }
  }
  return false;
}

}  // namespace spinaltap::drill
