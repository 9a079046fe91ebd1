#include "core/wire/mesh_message.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/base/box.h"
#include "core/wire/body.h"

namespace spinaltap::wire {
namespace {

constexpr const char* kWhat = "mesh";

Vec3 boxCentre(std::span<const Vec3> points) {
  if (points.empty()) return {};
  const auto [low, high] = boxAround(points);
  const Vec3 centre = (low + high) * 0.5;
  return {std::floor(centre.x + 0.5), std::floor(centre.y + 0.5), std::floor(centre.z + 0.5)};
}

void writeFloats(ByteWriter& out, std::span<const Vec3> points, const Vec3& origin) {
  std::vector<float> floats;
  floats.reserve(3 * points.size());
  for (const Vec3& p : points) {
    const Vec3 local = p - origin;
    for (const double v : {local.x, local.y, local.z}) floats.push_back(static_cast<float>(v));
  }
  out.array(std::span<const float>(floats));
}

/// Empty when a number is not finite or too few are left.
std::vector<Vec3> readFloats(ByteReader& in, std::uint32_t count, const Vec3& origin) {
  const std::vector<float> floats = in.array<float>(3ull * count);
  std::vector<Vec3> points(floats.size() / 3);
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i] = Vec3{floats[3 * i], floats[3 * i + 1], floats[3 * i + 2]} + origin;
    if (!isFinite(points[i])) return {};
  }
  return points;
}

}  // namespace

std::vector<std::byte> encodeMesh(const mesh::TriangleMesh& mesh) {
  assert(mesh.normals.size() == mesh.vertices.size());
  ByteWriter out;
  out.reserve(40 + 24 * mesh.vertices.size() + 12 * mesh.triangles.size());
  out.u32(kMeshMagic), out.u32(1);
  out.u32(static_cast<std::uint32_t>(mesh.vertices.size()));
  out.u32(static_cast<std::uint32_t>(mesh.triangles.size()));
  const Vec3 origin = boxCentre(mesh.vertices);
  out.vec3(origin);
  writeFloats(out, mesh.vertices, origin);
  writeFloats(out, mesh.normals, {});
  for (const auto& triangle : mesh.triangles) out.array(std::span<const std::uint32_t>(triangle));
  return out.take();
}

Result<mesh::TriangleMesh> decodeMesh(std::span<const std::byte> bytes) {
  ByteReader in(bytes);
  if (auto ok = readPreamble(in, kWhat, kMeshMagic); !ok) return tl::unexpected(ok.error());
  const std::uint32_t vertices = in.u32(), triangles = in.u32();
  const Vec3 origin = in.vec3();
  if (in.failed() || in.left() != 24ull * vertices + 12ull * triangles) {
    return corrupt(kWhat, 8, "counts that do not fit its length");
  }
  if (!isFinite(origin)) return corrupt(kWhat, 16, "an origin that is not finite");
  mesh::TriangleMesh mesh;
  mesh.vertices = readFloats(in, vertices, origin);
  if (mesh.vertices.size() != vertices) return corrupt(kWhat, in.offset(), "a position that is not finite");
  mesh.normals = readFloats(in, vertices, {});
  if (mesh.normals.size() != vertices) return corrupt(kWhat, in.offset(), "a normal that is not finite");
  mesh.triangles.resize(triangles);
  for (auto& triangle : mesh.triangles) {
    for (std::uint32_t& corner : triangle) {
      corner = in.u32();
      if (corner >= vertices) return corrupt(kWhat, in.offset() - 4, "a triangle that names no vertex");
    }
  }
  if (auto ok = checkEnd(in, kWhat); !ok) return tl::unexpected(ok.error());
  return mesh;
}

}  // namespace spinaltap::wire
