// core/mesh/triangle_mesh.h - triangles of an implicit surface, in the patient frame.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "core/base/vec3.h"

namespace spinaltap::mesh {

struct TriangleMesh {
  std::vector<Vec3> vertices;                           ///< #V, mm, patient frame
  std::vector<Vec3> normals;                            ///< #V unit, outward
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< #T, counter-clockwise seen from outside
};

}  // namespace spinaltap::mesh
