// core/tradeoff/measure.h - how good a reconstructed surface is, in figures.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/field.h"
#include "core/mesh/triangle_mesh.h"
#include "core/phantom/phantom.h"

namespace spinaltap::tradeoff {

/// Distances in mm, signed: positive outside the bone. Percentiles are of their sizes.
struct Distances {
  std::size_t count = 0;
  double mean_mm = 0, rms_mm = 0, p95_mm = 0, p99_mm = 0, most_mm = 0;
};
[[nodiscard]] Distances summarise(std::vector<double> signed_mm);

/// Points spread evenly by area over the triangles; the same for the same seed. @pre the mesh is not empty.
[[nodiscard]] std::vector<Vec3> pointsOn(const mesh::TriangleMesh& mesh, std::size_t count, std::uint64_t seed);

/// Of the mesh from the exact surface: `count` points spread by area.
[[nodiscard]] Distances fromTruth(const mesh::TriangleMesh& mesh, const phantom::Phantom& truth, std::size_t count,
                                  std::uint64_t seed);

/// Of points from the field's zero set, each to a foot found by five steps of Newton along the gradient: what a mesh
/// that misses a process does not show. A point whose foot is farther than most_mm counts with most_mm.
[[nodiscard]] Distances toSurface(const Field& field, const std::vector<Vec3>& points, double most_mm);

/// Points on the exact surface: random ones near it, moved there.
[[nodiscard]] std::vector<Vec3> pointsOfTruth(const phantom::Phantom& truth, std::size_t count, std::uint64_t seed);

struct Sides {
  std::size_t asked = 0, wrong = 0;
};
/// Random points of the bone's box and 4 mm around, those nearer than margin_mm to the surface left out: how many the
/// field has on the wrong side.
[[nodiscard]] Sides sidesOf(const Field& field, const phantom::Phantom& truth, double margin_mm, std::size_t count,
                            std::uint64_t seed);

/// RMS height of the vertices over quadrics through those within kRoughnessRadius_mm: steps and ripples that are
/// shorter than some 3 mm. A smooth bone's own roundings leave about 0.01 mm.
[[nodiscard]] double roughnessOf(const mesh::TriangleMesh& mesh);
inline constexpr double kRoughnessRadius_mm = 1.5;

/// @pre closed.
[[nodiscard]] double volumeOf(const mesh::TriangleMesh& mesh);
/// By counting cells whose centres are inside. @cost a second at 0.25 mm.
[[nodiscard]] double volumeOf(const phantom::Phantom& truth, double cell_mm = 0.25);

}  // namespace spinaltap::tradeoff
