// tests/bench/marching_cubes.h - the usual rival: every node of a dense grid, linear interpolation.
#pragma once
#include "core/base/field.h"
#include "core/mesh/polygonise.h"

namespace spinaltap::mesh {

/// Lorensen and Cline, "Marching Cubes", SIGGRAPH 1987, with one vertex an edge. The field is asked at all nodes of the
/// box in one call, then for the normals. Closed where the surface stays inside the box.
[[nodiscard]] TriangleMesh marchingCubes(const Field& field, const PolygoniseOptions& options);

}  // namespace spinaltap::mesh
