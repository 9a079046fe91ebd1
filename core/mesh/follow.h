// core/mesh/follow.h - asks the field at the lattice's nodes along its zero set, and nowhere else (internal).
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "core/base/field.h"
#include "core/base/result.h"
#include "core/mesh/node_map.h"

namespace spinaltap::mesh {

/// The nodes that were asked, sorted by key. Every corner of every tetrahedron that the surface crosses is among them.
struct Cloud {
  std::vector<Key> keys;
  std::vector<double> values;  ///< finite
  /// #nodes: the number of the node along each step, or NodeMap::kNone. Such a neighbour counts as being on the same
  /// side, since no crossing was found between.
  std::vector<std::array<std::uint32_t, kSteps>> around;
};

/// Begins in the cubes that hold seeds; where such a cube is not crossed, in the one that its values point to, and if
/// that is not crossed either, in the 27 around it. Then steps over every edge that the surface crosses. Each wave is
/// one call of the field, its points in the order of their keys.
/// @error NotFinite (seed or field), NotFound (no crossing), InvalidArgument (the surface leaves the box), Limit.
[[nodiscard]] Result<Cloud> follow(const Field& field, const Lattice& lattice, std::span<const Vec3> seeds_patient,
                                   const std::function<void(double)>& progress);

/// "the field is not finite at (x, y, z) mm".
[[nodiscard]] tl::unexpected<Error> notFinite(const Vec3& at_patient);

}  // namespace spinaltap::mesh
