// tests/core/mesh/mesh_check.h - what every closed mesh must satisfy, counted without trusting the polygoniser.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include "core/mesh/triangle_mesh.h"

namespace spinaltap::mesh {

struct MeshCheck {
  std::size_t open_edges = 0;      ///< directed edges without exactly one opposite
  std::size_t repeated_edges = 0;  ///< directed edges used twice: not manifold, or triangles turned against each other
  std::size_t pinched_vertices = 0;  ///< vertices whose triangles are not one fan
  std::size_t parts = 0;
  long long euler = 0;  ///< V - E + T
  double volume_mm3 = 0, area_mm2 = 0;
  double least_angle_deg = 180;         ///< of all triangles; 0 when one has no area
  std::size_t coincident_vertices = 0;  ///< at the very place of another: sheets that touch
};

namespace detail {

/// By the sine, which tells small angles apart where the cosine is 1.
inline double angleBetween(const Vec3& a, const Vec3& b) {
  return std::atan2(norm(cross(a, b)), dot(a, b)) * (180 / 3.14159265358979323846);
}

inline std::size_t countCoincident(const TriangleMesh& m) {
  std::vector<std::tuple<double, double, double>> places;
  for (const Vec3& v : m.vertices) places.emplace_back(v.x, v.y, v.z);
  std::sort(places.begin(), places.end());
  return static_cast<std::size_t>(places.end() - std::unique(places.begin(), places.end()));
}

inline std::uint32_t rootOf(std::vector<std::uint32_t>& parent, std::uint32_t at) {
  while (parent[at] != at) at = parent[at] = parent[parent[at]];
  return at;
}

/// Walks the triangles around each vertex; a fan that closes before it has used all of them is a pinch.
inline std::size_t countPinched(const TriangleMesh& m) {
  std::vector<std::map<std::uint32_t, std::uint32_t>> around(m.vertices.size());
  for (const auto& t : m.triangles)
    for (std::size_t n = 0; n < 3; ++n) around[t[n]][t[(n + 1) % 3]] = t[(n + 2) % 3];
  std::size_t pinched = 0;
  for (const auto& fan : around) {
    if (fan.empty()) continue;
    std::size_t steps = 0;
    std::uint32_t at = fan.begin()->first;
    do {
      const auto next = fan.find(at);
      if (next == fan.end()) break;
      at = next->second;
      ++steps;
    } while (at != fan.begin()->first && steps <= fan.size());
    pinched += steps != fan.size() ? 1 : 0;
  }
  return pinched;
}

}  // namespace detail

inline MeshCheck check(const TriangleMesh& m) {
  MeshCheck out;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> directed;
  std::vector<std::uint32_t> parent(m.vertices.size());
  for (std::uint32_t v = 0; v < parent.size(); ++v) parent[v] = v;
  for (const auto& t : m.triangles) {
    for (std::size_t n = 0; n < 3; ++n) {
      ++directed[{t[n], t[(n + 1) % 3]}];
      parent[detail::rootOf(parent, t[n])] = detail::rootOf(parent, t[(n + 1) % 3]);
    }
    const Vec3 &a = m.vertices[t[0]], &b = m.vertices[t[1]], &c = m.vertices[t[2]];
    // From a corner of the mesh: far from the origin the products would lose all digits.
    const Vec3& o = m.vertices.front();
    out.volume_mm3 += dot(a - o, cross(b - o, c - o)) / 6;
    out.area_mm2 += norm(cross(b - a, c - a)) / 2;
    out.least_angle_deg = std::min({out.least_angle_deg, detail::angleBetween(b - a, c - a),
                                    detail::angleBetween(c - b, a - b), detail::angleBetween(a - c, b - c)});
  }
  for (const auto& [edge, uses] : directed) {
    out.repeated_edges += uses > 1 ? 1 : 0;
    out.open_edges += directed.count({edge.second, edge.first}) == 0 ? 1 : 0;
  }
  for (std::uint32_t v = 0; v < parent.size(); ++v) out.parts += parent[v] == v ? 1 : 0;
  out.euler = static_cast<long long>(m.vertices.size()) - static_cast<long long>(directed.size() / 2) +
              static_cast<long long>(m.triangles.size());
  out.pinched_vertices = detail::countPinched(m);
  out.coincident_vertices = detail::countCoincident(m);
  return out;
}

}  // namespace spinaltap::mesh
