// core/surface/ct_edge.h - where the CT itself says that bone ends, along one normal (internal to surface).
#pragma once
#include <optional>

#include "core/surface/surface.h"

namespace spinaltap::surface {

/// Offset in mm along `normal` (outward) from `place` to the CT's edge: where it falls half-way from the cortex to what
/// surrounds it. Both in the grid's own axes (place = voxel * spacing).
/// Empty when there is no fall of minimum_contrast_hu within the reach.
[[nodiscard]] std::optional<double> findCtEdge(const volume::CtVolume& ct, const Vec3& place_mm, const Vec3& normal,
                                               const BoundaryOptions& options);

}  // namespace spinaltap::surface
