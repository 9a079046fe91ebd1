// core/wire/mesh_message.h - a triangle mesh as bytes ('STM1'). Layout: server/contract/haptics.md, "Bodies".
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/result.h"
#include "core/mesh/triangle_mesh.h"

namespace spinaltap::wire {

inline constexpr std::uint32_t kMeshMagic = 0x314d5453;  ///< the bytes 'S' 'T' 'M' '1'

/// Positions are written as floats relative to the centre of their box (rounded to a whole mm), so a mesh 200 mm wide
/// is kept to 8e-6 mm however far from zero the scanner put it.
/// @pre as many normals as vertices.
[[nodiscard]] std::vector<std::byte> encodeMesh(const mesh::TriangleMesh& mesh);

/// @error Corrupt (naming the offset: magic, a length that does not fit, an index past the vertices, a number that is
/// not
///        finite, bytes left over), Unsupported (version).
[[nodiscard]] Result<mesh::TriangleMesh> decodeMesh(std::span<const std::byte> bytes);

}  // namespace spinaltap::wire
