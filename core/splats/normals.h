// core/splats/normals.h - positions and normals of lattice points; shared inside splats.
#pragma once
#include <cstdint>

#include "core/point_volume/point_volume.h"

namespace spinaltap::splats {

[[nodiscard]] Vec3 positionOf(const point_volume::Lattice& lattice, const point_volume::DiscTable& disc,
                              std::uint32_t index);

/// From the middle of the alive to the middle of the dead points within 2.6 spacings; a plane at any tilt comes out
/// within 25 degrees, 8 on average (tested). Sites beyond the lattice do not count; -z where both middles coincide.
[[nodiscard]] Vec3 estimateNormal(const point_volume::PointVolume& volume, const point_volume::DiscTable& disc,
                                  std::uint32_t index);

}  // namespace spinaltap::splats
