// tests/bench/cube_table.h - which triangles cut a cube, for each of the 256 ways its corners can lie inside.
// The idea is Lorensen and Cline, "Marching Cubes", SIGGRAPH 1987; the table is derived here from one rule a face, so
// that neighbours always agree and the surface is closed and manifold.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

namespace spinaltap::mesh {

/// Corner c lies at (c & 1, c >> 1 & 1, c >> 2 & 1).
struct CubeEdge {
  int corner;  ///< the end with the lower coordinate
  int axis;    ///< 0, 1, 2: the edge runs along it
};

/// Edge e = 4 * axis + its number among the four of that axis.
[[nodiscard]] CubeEdge cubeEdge(int edge);

struct CubeTable {
  /// triangles[mask]: triples of edges; bit c of the mask says that corner c is inside. Counter-clockwise from outside.
  std::array<std::vector<std::array<std::uint8_t, 3>>, 256> triangles;
};

/// Rule: on a face whose diagonal corners are inside, the two inside corners are kept apart. A face is ruled by its own
/// four corners alone, so both its cubes draw the same lines on it, in opposite directions. Polygons are then cut by
/// diagonals that never lie in a face, where the neighbour could have the same one.
[[nodiscard]] const CubeTable& cubeTable();

}  // namespace spinaltap::mesh
