// server/mesh_out/mesh_file.h - a triangle mesh as a file that other programs read.
#pragma once
#include <cstddef>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/mesh/triangle_mesh.h"

namespace spinaltap::mesh_out {

enum class Format { Stl, Ply };

/// "stl" or "ply". @error InvalidArgument.
[[nodiscard]] Result<Format> formatNamed(std::string_view name);
[[nodiscard]] const char* nameOf(Format format);
/// What HTTP calls it.
[[nodiscard]] const char* mediaTypeOf(Format format);

/// The whole file; millimetres in the patient's LPS frame, which its head says. Nothing in it names a patient.
/// STL: binary; 80 bytes of head, u32 count, then for each triangle f32 normal and corners, u16 zero.
/// PLY: binary, little endian; double x y z, float nx ny nz a vertex, three indices a face.
/// @pre normals of the mesh: one a vertex, or none (PLY then has none). Indices below the number of vertices.
/// @error Limit: STL where its single precision is coarser than 1e-3 mm, 8 m and more from the origin; over 2^31 - 1
///        triangles or vertices.
[[nodiscard]] Result<std::vector<std::byte>> encode(const mesh::TriangleMesh& mesh, Format format);

}  // namespace spinaltap::mesh_out
