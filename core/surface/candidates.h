// core/surface/candidates.h - an even supply of places on a smoothed label's boundary (internal to surface).
#pragma once
#include <vector>

#include "core/surface/smooth_label.h"

namespace spinaltap::surface {

/// A boundary point in the making, in the grid's own axes.
struct Candidate {
  Vec3 place_mm;
  Vec3 normal;       ///< unit, outward
  bool cut = false;  ///< on the face where the volume ends in bone
};

/// On the half-way level, and on the volume's faces where the label reaches them: no two of one wall closer than
/// spacing_mm, none of the boundary farther than about that from one. Bits do not depend on the number of threads.
/// @cost  linear in the box's volume over spacing^3.
[[nodiscard]] std::vector<Candidate> candidatesOn(const SmoothLabel& label, double spacing_mm);

}  // namespace spinaltap::surface
