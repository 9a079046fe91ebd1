#include "core/mesh/pinches.h"

#include <algorithm>
#include <cstddef>

namespace spinaltap::mesh {
namespace {

/// A triangle seen from one of its corners: the corners after and before it.
struct Corner {
  std::uint32_t next, last;
};

/// Walks from triangle to triangle around a vertex: each must be met once.
bool isOneFan(std::span<const Corner> corners) {
  std::size_t at = 0;
  for (std::size_t steps = 1; steps <= corners.size(); ++steps) {
    std::size_t found = corners.size();
    for (std::size_t c = 0; c < corners.size(); ++c) {
      if (corners[c].next != corners[at].last) continue;
      if (found != corners.size()) return false;  // two triangles leave the vertex along one edge
      found = c;
    }
    if (found == corners.size()) return false;
    at = found;
    if (at == 0) return steps == corners.size();
  }
  return false;
}

}  // namespace

std::vector<std::uint32_t> pinchedVertices(const TriangleMesh& mesh, std::span<const std::uint32_t> candidates) {
  constexpr std::uint32_t kNone = 0xffffffff;
  std::vector<std::uint32_t> place(mesh.vertices.size(), kNone);
  for (std::uint32_t i = 0; i < candidates.size(); ++i) place[candidates[i]] = i;
  const auto eachCorner = [&](const auto& use) {
    for (const auto& t : mesh.triangles) {
      for (std::size_t n = 0; n < 3; ++n) {
        if (place[t[n]] != kNone) use(place[t[n]], Corner{t[(n + 1) % 3], t[(n + 2) % 3]});
      }
    }
  };
  std::vector<std::size_t> first(candidates.size() + 1, 0);
  eachCorner([&](std::uint32_t at, const Corner&) { ++first[at + 1]; });
  for (std::size_t i = 0; i < candidates.size(); ++i) first[i + 1] += first[i];
  std::vector<Corner> corners(first.back());
  std::vector<std::size_t> next(first.begin(), first.end() - 1);
  eachCorner([&](std::uint32_t at, const Corner& corner) { corners[next[at]++] = corner; });

  std::vector<std::uint32_t> pinched;
  for (std::uint32_t i = 0; i < candidates.size(); ++i) {
    const auto around = std::span(corners).subspan(first[i], first[i + 1] - first[i]);
    if (!around.empty() && !isOneFan(around)) pinched.push_back(i);
  }
  return pinched;
}

}  // namespace spinaltap::mesh
