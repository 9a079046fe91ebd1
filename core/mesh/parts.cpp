#include "core/mesh/parts.h"

#include <algorithm>
#include <cstddef>
#include <limits>

namespace spinaltap::mesh {
namespace {

std::uint32_t rootOf(std::vector<std::uint32_t>& parent, std::uint32_t at) {
  while (parent[at] != at) {
    parent[at] = parent[parent[at]];
    at = parent[at];
  }
  return at;
}

/// A vertex that stands for each triangle's part.
std::vector<std::uint32_t> partOfTriangles(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> parent(mesh.vertices.size());
  for (std::uint32_t v = 0; v < parent.size(); ++v) parent[v] = v;
  for (const auto& t : mesh.triangles) {
    parent[rootOf(parent, t[0])] = rootOf(parent, t[1]);
    parent[rootOf(parent, t[1])] = rootOf(parent, t[2]);
  }
  std::vector<std::uint32_t> out;
  out.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) out.push_back(rootOf(parent, t[0]));
  return out;
}

}  // namespace

TriangleMesh largestPart(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return {};
  const std::vector<std::uint32_t> part = partOfTriangles(mesh);
  std::vector<std::size_t> size(mesh.vertices.size(), 0);
  for (const std::uint32_t p : part) ++size[p];
  const auto best = static_cast<std::uint32_t>(std::max_element(size.begin(), size.end()) - size.begin());

  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number(mesh.vertices.size(), kUnused);
  for (std::size_t t = 0; t < part.size(); ++t) {
    if (part[t] != best) continue;
    for (const std::uint32_t v : mesh.triangles[t]) number[v] = 0;
  }
  TriangleMesh out;
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] == kUnused) continue;
    number[v] = static_cast<std::uint32_t>(out.vertices.size());
    out.vertices.push_back(mesh.vertices[v]);
    out.normals.push_back(mesh.normals[v]);
  }
  for (std::size_t t = 0; t < part.size(); ++t) {
    const auto& old = mesh.triangles[t];
    if (part[t] == best) out.triangles.push_back({number[old[0]], number[old[1]], number[old[2]]});
  }
  return out;
}

}  // namespace spinaltap::mesh
