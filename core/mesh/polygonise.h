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

/// Follows the surface from cells around `seeds` (points within a cell of it; those outside the box are ignored).
/// Closed, manifold and consistently oriented outward; a surface that leaves the box is an error, never a hole. A node
/// where the field is exactly zero counts as outside, and vertices keep a thousandth of a cell from the nodes, so no
/// triangle collapses. The mesh does not depend on the order of the seeds.
/// @error InvalidArgument (box, cell, or the surface leaves the box), NotFinite, NotFound (no seed's neighbourhood
///        crosses the surface), Limit (over 20 million nodes).
/// @cost  about four evaluations a cell that the surface crosses; some 2 triangles each.
[[nodiscard]] Result<TriangleMesh> polygonise(const Field& field, std::span<const Vec3> seeds_patient,
                                              const PolygoniseOptions& options, const Progress& progress = {});

}  // namespace spinaltap::mesh
