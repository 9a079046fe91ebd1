// core/mesh/stuff.h - the triangles that part the tetrahedra's insides from their outsides (internal).
// After: Labelle and Shewchuk, "Isosurface Stuffing", SIGGRAPH 2007, section 3.3.
#pragma once
#include "core/mesh/crossings.h"
#include "core/mesh/triangle_mesh.h"

namespace spinaltap::mesh {

struct Stuffed {
  TriangleMesh mesh;  ///< without normals; vertices in the order of their nodes' keys
  /// The vertices that are moved nodes, ascending, and their nodes. Only at these can sheets touch: at a cut, the
  /// triangles are those of the tetrahedra around its edge.
  std::vector<std::uint32_t> vertices, nodes;
  /// Nodes of faces of moved nodes with bone on either side: it would grow together there. May hold a node repeatedly.
  std::vector<std::uint32_t> touching;
};

[[nodiscard]] Stuffed stuff(const Cloud& cloud, const Lattice& lattice, const Crossings& crossings);

/// The smallest of a triangle's angles is the one with the largest cosine. 1 when two corners coincide.
[[nodiscard]] double largestCosine(const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace spinaltap::mesh
