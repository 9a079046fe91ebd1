// server/mesh_out/within.h - whether one surface lies near another, at every point and not at samples.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/triangle_mesh.h"

namespace spinaltap::mesh_out {

/// Squared distance from p to the triangle a, b, c. After: Ericson, "Real-Time Collision Detection" (2005), 5.1.5.
[[nodiscard]] double squaredDistance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

/// Triangles in cubes, to be found by place. Keeps a reference to the mesh.
class TriangleGrid {
 public:
  /// @pre the mesh has triangles, its vertices are finite; reach > 0.
  TriangleGrid(const mesh::TriangleMesh& mesh, double reach_mm);

  /// A triangle that shows every point of the piece to be within `reach_mm`, or kNone: either it has the piece's three
  /// corners in reach, and so all between them, since the distance from a convex set is a convex function; or its
  /// distance from the piece's middle leaves room for all of it. `hint` is tried first.
  [[nodiscard]] std::uint32_t nearPiece(const std::array<Vec3, 3>& piece, std::uint32_t hint) const;
  [[nodiscard]] std::uint32_t nearPoint(const Vec3& point, std::uint32_t hint) const;
  static constexpr std::uint32_t kNone = 0xffffffff;

 private:
  [[nodiscard]] double squaredDistanceTo(std::uint32_t triangle, const Vec3& point) const;
  /// Of the cube that holds the point: those that can be in reach of it.
  [[nodiscard]] std::span<const std::uint32_t> candidates(const Vec3& point) const;

  const mesh::TriangleMesh& mesh_;
  double reach_mm_, side_mm_ = 1;
  double most_radius_mm_ = 0;  ///< no piece that reaches farther from its middle can lie along one triangle
  Vec3 low_;
  std::array<std::size_t, 3> cubes_{};
  std::vector<std::uint32_t> first_, triangles_;  ///< first_[cube] .. first_[cube + 1] in triangles_
};

/// The triangles of `mesh` that have a point farther than the grid's reach from its surface; ascending. Pieces of a
/// triangle are split until each lies near one triangle of the other surface, or a point of it does not: so what is not
/// listed is proved. Pieces smaller than a thousandth of the reach are given up, and their triangle is listed.
/// @cost some 0.2 us a piece, on all processors; pieces are about as large as the other surface's triangles.
[[nodiscard]] std::vector<std::uint32_t> farTriangles(const mesh::TriangleMesh& mesh, const TriangleGrid& other,
                                                      double reach_mm);

}  // namespace spinaltap::mesh_out
