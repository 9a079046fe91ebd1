// core/segment/neighbours.h - the vertebrae above and below one whose body is known (internal to segment).
#pragma once
#include "core/segment/body.h"

namespace spinaltap::segment {

struct Rival {
  Body body;
  bool found = false;  ///< false: nothing clear there, so body is the wanted one's likeness, moved on
};

/// @param side  1: towards the head, -1: towards the feet.
[[nodiscard]] Rival findNeighbour(const Scene& scene, const Body& wanted, double side);

}  // namespace spinaltap::segment
