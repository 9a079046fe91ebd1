#include "tests/bench/cube_table.h"

#include <cassert>

namespace spinaltap::mesh {
namespace {

using Triangles = std::vector<std::array<std::uint8_t, 3>>;

int edgeBetween(int corner_a, int corner_b) {
  const int axis_bit = corner_a ^ corner_b;
  const int axis = axis_bit == 1 ? 0 : axis_bit == 2 ? 1 : 2;
  const int low = corner_a & corner_b;
  // The two bits other than the axis's, packed.
  const int others = axis == 0 ? low >> 1 : axis == 1 ? (low & 1) | (low >> 1 & 2) : low & 3;
  return 4 * axis + others;
}

/// The four corners of a face, counter-clockwise seen from outside the cube.
std::array<int, 4> faceCorners(int axis, int side) {
  const int u = 1 << ((axis + 1) % 3), v = 1 << ((axis + 2) % 3), base = side << axis;
  if (side == 1) return {base, base | u, base | u | v, base | v};
  return {base, base | v, base | u | v, base | u};
}

bool shareAFace(int edge_a, int edge_b) {
  const CubeEdge a = cubeEdge(edge_a), b = cubeEdge(edge_b);
  for (int axis = 0; axis < 3; ++axis) {
    if (a.axis != axis && b.axis != axis && (a.corner >> axis & 1) == (b.corner >> axis & 1)) return true;
  }
  return false;
}

/// next[e]: where the line that leaves crossing e on one face arrives. Every crossing is left once and reached once.
std::array<int, 12> linesOf(int mask) {
  std::array<int, 12> next;
  next.fill(-1);
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 2; ++side) {
      const std::array<int, 4> c = faceCorners(axis, side);
      for (int start = 0; start < 4; ++start) {
        const auto inside = [&](int at) { return (mask >> c[static_cast<std::size_t>(at & 3)] & 1) != 0; };
        const auto crossing = [&](int at) {
          return edgeBetween(c[static_cast<std::size_t>(at & 3)], c[static_cast<std::size_t>((at + 1) & 3)]);
        };
        if (inside(start) || !inside(start + 1)) continue;  // not the entry of a run of inside corners
        int last = start + 1;
        while (inside(last + 1)) ++last;
        next[static_cast<std::size_t>(crossing(start))] = crossing(last);
      }
    }
  }
  return next;
}

/// Cuts polygon[first .. last] into triangles by diagonals that lie in no face; the side first-last is given.
bool cut(const std::vector<int>& polygon, std::size_t first, std::size_t last, Triangles& out) {
  if (last - first < 2) return true;
  for (std::size_t mid = first + 1; mid < last; ++mid) {
    const bool left_ok = mid == first + 1 || !shareAFace(polygon[first], polygon[mid]);
    const bool right_ok = mid + 1 == last || !shareAFace(polygon[mid], polygon[last]);
    if (!left_ok || !right_ok) continue;
    const std::size_t before = out.size();
    out.push_back({static_cast<std::uint8_t>(polygon[first]), static_cast<std::uint8_t>(polygon[mid]),
                   static_cast<std::uint8_t>(polygon[last])});
    if (cut(polygon, first, mid, out) && cut(polygon, mid, last, out)) return true;
    out.resize(before);
  }
  return false;
}

Triangles trianglesOf(int mask) {
  std::array<int, 12> next = linesOf(mask);
  Triangles out;
  for (std::size_t start = 0; start < 12; ++start) {
    std::vector<int> polygon;
    for (int e = static_cast<int>(start); next[static_cast<std::size_t>(e)] >= 0;) {
      polygon.push_back(e);
      const int to = next[static_cast<std::size_t>(e)];
      next[static_cast<std::size_t>(e)] = -1;
      e = to;
    }
    if (polygon.empty()) continue;
    [[maybe_unused]] const bool done = cut(polygon, 0, polygon.size() - 1, out);
    assert(done);  // holds for all 256, see the tests
  }
  return out;
}

}  // namespace

CubeEdge cubeEdge(int edge) {
  const int axis = edge / 4, others = edge % 4;
  const int corner = axis == 0 ? others << 1 : axis == 1 ? (others & 1) | (others & 2) << 1 : others;
  return {corner, axis};
}

const CubeTable& cubeTable() {
  static const CubeTable table = [] {
    CubeTable t;
    for (int mask = 0; mask < 256; ++mask) t.triangles[static_cast<std::size_t>(mask)] = trianglesOf(mask);
    return t;
  }();
  return table;
}

}  // namespace spinaltap::mesh
