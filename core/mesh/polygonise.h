// core/mesh/polygonise.h - a closed mesh of the zero set of a field, asking the field only near it.
// After: Labelle and Shewchuk, "Isosurface Stuffing: Fast Tetrahedral Meshes with Good Dihedral Angles", SIGGRAPH 2007;
// of their tetrahedra only the surface is kept.
#pragma once
#include <functional>
#include <span>

#include "core/base/field.h"
#include "core/base/result.h"
#include "core/mesh/triangle_mesh.h"

namespace spinaltap::mesh {

struct PolygoniseOptions {
  /// The field is asked at a body-centred cubic lattice with as many nodes as a grid of cubes with this side has, so
  /// that "0.5 mm" costs and resolves what it does elsewhere. Edges of triangles are 0.9 of it on average.
  double cell_mm = 0.7;
  Vec3 low_patient, high_patient;  ///< the surface is sought inside this box
};

using Progress = std::function<void(double)>;

/// No angle of any triangle is smaller: whatever the field, by construction (see crossings.h).
inline constexpr double kLeastAngle_deg = 13.4;

/// Follows the surface from cells around `seeds` (points within a cell of it; those outside the box are ignored).
///
/// The mesh is closed, manifold, consistently oriented outward, and nowhere cuts or touches itself; a surface that
/// leaves the box is an error, never a hole. It has the topology of the field's signs at the nodes: no sheet or gap
/// that they show is lost, what lies between all nodes is not there. Exactly zero counts as outside.
///
/// Vertices lie on edges of the lattice, where the last secant moved by less than 0.0013 cells; on a smooth surface
/// most are within 1e-4 cells of it. Only where bone or a gap is thinner than about a cell, so that a sheet of single
/// nodes stands for it, may vertices be up to 0.4 cells off to keep its sides apart. Normals are the field's gradient,
/// unit.
///
/// The same bits from any number of threads behind `field`, any order of the seeds, and however many of them.
/// @error InvalidArgument (box, cell, or the surface leaves the box: the message says where), NotFinite, NotFound (no
///        seed's neighbourhood crosses the surface), Limit (over 20 million nodes).
/// @cost  Per cell_mm^2 of surface: 1.4 vertices, 2.9 triangles, some 5 values and 1.4 gradients of the field. With
///        seeds at every second cell, a dozen calls of the field; from one seed, one more for each further cell.
[[nodiscard]] Result<TriangleMesh> polygonise(const Field& field, std::span<const Vec3> seeds_patient,
                                              const PolygoniseOptions& options, const Progress& progress = {});

}  // namespace spinaltap::mesh
