// server/mesh_out/simplify.h - fewer triangles, to an error in millimetres that holds.
#pragma once
#include "core/base/result.h"
#include "core/mesh/triangle_mesh.h"

namespace spinaltap::mesh_out {

inline constexpr double kLeastError_mm = 1e-3, kMostError_mm = 10;

/// A mesh of some of the old vertices, with their normals. Every point of either surface is within `max_error_mm` of
/// the other: proved (within.h), not sampled. Closed, manifold and consistently oriented where the old one is; no part
/// is lost; none newly faces against its corners' normals. The library's own error is a root mean square, and it
/// neither keeps manifolds nor avoids folds; places where any of this fails keep their old triangles. Least angles are
/// not kept.
/// @pre a closed manifold mesh, finite, with a normal a vertex; an empty one stays empty.
/// @error InvalidArgument (error outside 0.001 to 10 mm).
/// @cost some seconds for 150,000 triangles and 0.1 mm, more for less; see tests/bench/bench_mesh.cpp.
[[nodiscard]] Result<mesh::TriangleMesh> simplify(const mesh::TriangleMesh& mesh, double max_error_mm);

}  // namespace spinaltap::mesh_out
