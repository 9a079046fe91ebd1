// core/mesh/polygonise.h - a closed mesh of the zero set of a field, visiting only cells near the surface.
#pragma once
#include <functional>
#include <span>

#include "core/base/field.h"
#include "core/base/result.h"
#include "core/mesh/triangle_mesh.h"

namespace spinaltap::mesh {

struct PolygoniseOptions {
  double cell_mm = 0.7;
  Vec3 low_patient, high_patient;  ///< the surface is sought inside this box
};

using Progress = std::function<void(double)>;

/// Follows the surface from cells around `seeds` (points near it). Closed and manifold where the field's zero set
/// is inside the box; consistently oriented outward.
/// @error InvalidArgument, NotFinite, NotFound (no seed's neighbourhood crosses the surface), Limit.
[[nodiscard]] Result<TriangleMesh> polygonise(const Field& field, std::span<const Vec3> seeds_patient,
                                              const PolygoniseOptions& options, const Progress& progress = {});

}  // namespace spinaltap::mesh
