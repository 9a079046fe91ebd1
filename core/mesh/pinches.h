// core/mesh/pinches.h - where sheets of a mesh touch (internal).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/triangle_mesh.h"

namespace spinaltap::mesh {

/// Which of the vertices have triangles that are not one closed fan, or an edge with more than two triangles.
/// Only the candidates are looked at; the answer has their places in the list.
[[nodiscard]] std::vector<std::uint32_t> pinchedVertices(const TriangleMesh& mesh,
                                                         std::span<const std::uint32_t> candidates);

}  // namespace spinaltap::mesh
