// core/mesh/lattice.h - the body-centred cubic lattice: where the field is asked, and the tetrahedra between
// (internal). After: Labelle and Shewchuk, "Isosurface Stuffing", SIGGRAPH 2007, section 3.
#pragma once
#include <array>
#include <cstdint>

#include "core/base/vec3.h"

namespace spinaltap::mesh {

/// In half cells from the box's low corner; all three even (a cube's corner) or all three odd (a cube's middle).
struct Node {
  int x, y, z;
  friend constexpr bool operator==(const Node&, const Node&) = default;
};
constexpr Node operator+(const Node& a, const Node& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
constexpr Node operator-(const Node& a, const Node& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }

/// A node as one number: bricks of 8 x 8 x 8 cubes in order, and the nodes inside one in order, so that neighbours in
/// space are mostly neighbours in memory.
using Key = std::uint64_t;
inline constexpr int kLocalBits = 10;
inline constexpr int kMostHalves = (1 << 21) - 1;  ///< 17 bits of bricks and 4 inside one, along each axis

/// @pre every coordinate in [0, kMostHalves].
constexpr Key keyOf(const Node& n) {
  const auto wide = [](int v) { return static_cast<Key>(v); };
  const Key brick = (wide(n.z >> 4) << 34) | (wide(n.y >> 4) << 17) | wide(n.x >> 4);
  const auto inside = [&](int v) { return wide(v >> 1 & 7); };
  return (brick << kLocalBits) | (inside(n.z) << 7) | (inside(n.y) << 4) | (inside(n.x) << 1) | wide(n.x & 1);
}
constexpr Node nodeOf(Key key) {
  const int odd = static_cast<int>(key & 1);
  const auto along = [&](int brick_shift, int local_shift) {
    const int brick = static_cast<int>(key >> (kLocalBits + brick_shift) & 0x1ffff);
    return (brick << 4) | (static_cast<int>(key >> local_shift & 7) << 1) | odd;
  };
  return {along(0, 1), along(17, 4), along(34, 7)};
}

/// Every edge is a node and one of these steps from it: three long ones of two halves, four short ones to cube middles.
inline constexpr int kForward = 7, kSteps = 14;
inline constexpr std::array<Node, kSteps> kStep{{{2, 0, 0},
                                                 {0, 2, 0},
                                                 {0, 0, 2},
                                                 {1, 1, 1},
                                                 {1, 1, -1},
                                                 {1, -1, 1},
                                                 {1, -1, -1},
                                                 {-2, 0, 0},
                                                 {0, -2, 0},
                                                 {0, 0, -2},
                                                 {-1, -1, -1},
                                                 {-1, -1, 1},
                                                 {-1, 1, -1},
                                                 {-1, 1, 1}}};  ///< step d + 7 is step d backwards
constexpr bool isLong(int step) { return step % kForward < 3; }
/// Which step leads from a to b, or -1.
constexpr int stepBetween(const Node& a, const Node& b) {
  for (int d = 0; d < kSteps; ++d) {
    if (kStep[static_cast<std::size_t>(d)] == b - a) return d;
  }
  return -1;
}

/// The 14 neighbours of a node are the corners of a ball of 24 triangles around it; two of them are joined when they
/// are neighbours themselves. Bit d stands for the neighbour along step d.
using Neighbours = std::uint16_t;
inline constexpr Neighbours kAllNeighbours = (1U << kSteps) - 1U;
constexpr std::array<Neighbours, kSteps> makeJoined() {
  std::array<Neighbours, kSteps> joined{};
  for (std::size_t a = 0; a < kSteps; ++a) {
    for (std::size_t b = 0; b < kSteps; ++b) {
      if (stepBetween(kStep[a], kStep[b]) >= 0) joined[a] = static_cast<Neighbours>(joined[a] | 1U << b);
    }
  }
  return joined;
}
inline constexpr std::array<Neighbours, kSteps> kJoined = makeJoined();

/// Whether these neighbours hang together, and there is one.
constexpr bool isOnePiece(Neighbours set) {
  auto reached = static_cast<Neighbours>(set & (~set + 1U));
  for (Neighbours before = 0; reached != before;) {
    before = reached;
    for (std::size_t d = 0; d < kSteps; ++d) {
      if ((before >> d & 1U) != 0) reached = static_cast<Neighbours>(reached | (kJoined[d] & set));
    }
  }
  return set != 0 && reached == set;
}

/// The nodes around an edge, from its first end: those that are neighbours of both. 4 around a long edge, 6 a short
/// one.
struct EdgeRing {
  std::array<Node, 6> around{};
  int count = 0;
};
constexpr std::array<EdgeRing, kForward> makeEdgeRings() {
  std::array<EdgeRing, kForward> rings{};
  for (std::size_t d = 0; d < kForward; ++d) {
    for (const Node& to : kStep) {
      if (stepBetween(kStep[d], to) >= 0) rings[d].around[static_cast<std::size_t>(rings[d].count++)] = to;
    }
  }
  return rings;
}
inline constexpr std::array<EdgeRing, kForward> kEdgeRing = makeEdgeRings();

/// The six tetrahedra that belong to a node: corners 0-1 and 2-3 are long edges, the other four short ones, and
/// (1 - 0, 2 - 0, 3 - 0) is right-handed. Each tetrahedron of the lattice belongs to one node.
inline constexpr std::array<std::array<int, 2>, 6> kTetEdge{{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};
struct Tet {
  std::array<Node, 4> corner{};
  std::array<int, 6> owner{};              ///< of kTetEdge's edges: the corner from which the edge is a forward step,
  std::array<int, 6> step{};               ///< and that step
  std::array<std::size_t, 4> to_corner{};  ///< the step from corner 0
  /// Beyond the face against a corner lies that corner mirrored at the middle of the face's long edge (2-3 for corners
  /// 0 and 1, 0-1 for the others): the step there from that edge's first end.
  std::array<std::size_t, 4> to_mirrored{};
};
constexpr std::array<Tet, 6> makeTets() {
  std::array<Tet, 6> tets{};
  for (int kind = 0; kind < 6; ++kind) {
    const int axis = kind / 2, side = kind % 2 == 0 ? -1 : 1;
    const auto turned = [axis](int along, int next, int last) {
      return axis == 0 ? Node{along, next, last} : axis == 1 ? Node{last, along, next} : Node{next, last, along};
    };
    Tet& tet = tets[static_cast<std::size_t>(kind)];
    tet.corner = {Node{0, 0, 0}, turned(2, 0, 0), turned(1, side, side), turned(1, -side, side)};
    for (std::size_t e = 0; e < 6; ++e) {
      const auto a = static_cast<std::size_t>(kTetEdge[e][0]), b = static_cast<std::size_t>(kTetEdge[e][1]);
      const int step = stepBetween(tet.corner[a], tet.corner[b]);
      tet.owner[e] = kTetEdge[e][step < kForward ? 0 : 1];
      tet.step[e] = step % kForward;
    }
    for (std::size_t c = 0; c < 4; ++c) {
      tet.to_corner[c] = c == 0 ? 0 : static_cast<std::size_t>(stepBetween(tet.corner[0], tet.corner[c]));
      tet.to_mirrored[c] = static_cast<std::size_t>(stepBetween(tet.corner[c], tet.corner[c < 2 ? 3 : 1]));
    }
  }
  return tets;
}
inline constexpr std::array<Tet, 6> kTets = makeTets();

/// The lattice in a box: node (0, 0, 0) is its low corner, `last` the node at or beyond its high one.
struct Lattice {
  Vec3 low_patient;
  double half_mm = 0;  ///< half a cell
  Node last{0, 0, 0};

  [[nodiscard]] Vec3 place(const Node& n) const {
    return low_patient + Vec3{1.0 * n.x, 1.0 * n.y, 1.0 * n.z} * half_mm;
  }
  [[nodiscard]] bool holds(const Node& n) const {
    return n.x >= 0 && n.y >= 0 && n.z >= 0 && n.x <= last.x && n.y <= last.y && n.z <= last.z;
  }
};

}  // namespace spinaltap::mesh
