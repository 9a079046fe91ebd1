// core/mesh/parts.h - the separate surfaces of a mesh.
#pragma once
#include "core/mesh/triangle_mesh.h"

namespace spinaltap::mesh {

/// The connected part with the most triangles, its vertices renumbered in their old order. Coarse or noisy scans leave
/// specks beside a bone, and cavities inside it. An empty mesh stays empty.
[[nodiscard]] TriangleMesh largestPart(const TriangleMesh& mesh);

}  // namespace spinaltap::mesh
