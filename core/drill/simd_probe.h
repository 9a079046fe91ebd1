// core/drill/simd_probe.h - which point lies nearest to each of the bit's facets. Private to core/drill.
#pragma once
#include <cstddef>
#include <cstdint>

#include "core/base/vec3.h"
#include "core/point_volume/lattice.h"

namespace spinaltap::drill {

/// Places in the tool's frame, an array each.
struct PlaceArrays {
  const double *x_mm, *y_mm, *z_mm;
};
/// The tool in the path frame.
struct ToolFrame {
  Vec3 tip_mm, x, y, z;
};

inline constexpr std::uint32_t kNoPoint = 0xffffffff;

/// The point nearest to each place by disc, then by ring, then by slot; kNoPoint outside the lattice. Slots that are
/// equally near within 4e-9 turns may be told apart wrongly. The same bits on every target.
/// @pre frame and places are finite; the lattice is valid.
void nearestPoints(const point_volume::Lattice& lattice, const ToolFrame& tool, const PlaceArrays& places,
                   std::size_t count, std::uint32_t* nearest);

}  // namespace spinaltap::drill
