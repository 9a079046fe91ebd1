// core/tradeoff/contour.h - where a surface cuts a plane, and its outline seen along an axis: to be laid over others'.
#pragma once
#include <array>
#include <cstddef>
#include <vector>

#include "core/base/field.h"
#include "core/mesh/triangle_mesh.h"

namespace spinaltap::tradeoff {

struct Plane {
  Vec3 origin_patient;                 ///< the window's first corner
  Vec3 right{1, 0, 0}, down{0, 1, 0};  ///< unit, at right angles
  double width_mm = 0, height_mm = 0;
};

/// Places in the plane, mm along right and down. Closed when first and last are equal; open where it leaves the window.
using Polyline = std::vector<std::array<double, 2>>;

/// Values at the corners of nx by ny squares, row by row: (nx + 1) * (ny + 1) of them. Below zero is inside.
struct Sheet {
  std::size_t nx = 0, ny = 0;
  double step_mm = 0;
  std::vector<double> values;
};

/// The sheet's zero lines, by linear interpolation along the squares' sides; no two cross.
[[nodiscard]] std::vector<Polyline> linesOf(const Sheet& sheet);

/// The field's zero lines in the window, from squares of step_mm.
/// @pre step_mm > 0, at most some 4,000 steps a side.
[[nodiscard]] std::vector<Polyline> contourOf(const Field& field, const Plane& plane, double step_mm);

/// The outline of the mesh's shadow on the plane, light falling at right angles to it: the line where half of a square
/// is covered, within a quarter of step_mm. Holes through which one sees have lines too.
/// @pre as contourOf; right and down along two of the axes or not, as one likes. @cost linear in squares and triangles.
[[nodiscard]] std::vector<Polyline> silhouetteOf(const mesh::TriangleMesh& mesh, const Plane& plane, double step_mm);

}  // namespace spinaltap::tradeoff
