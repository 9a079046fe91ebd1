// core/rbf/interactions.h - which cubes of two octrees see which, and how (internal). After: Carrier, Greengard and
// Rokhlin, "A fast adaptive multipole algorithm for particle simulations", SIAM J. Sci. Stat. Comput. 9 (1988).
#pragma once
#include <cstdint>
#include <utility>
#include <vector>

#include "core/rbf/far_order.h"
#include "core/rbf/octree.h"

namespace spinaltap::rbf {

/// Every pair of a target and a source point is in exactly one of these.
struct Interactions {
  /// Per target node a list of source nodes.
  struct Lists {
    std::vector<std::uint32_t> first;  ///< #nodes + 1
    std::vector<std::uint32_t> source;
  };
  struct FarPair {
    std::uint32_t target, source;
    FarKind kind;
  };
  /// Target nodes that one thread takes at a time.
  static constexpr std::size_t kGroup = 192;

  Lists near;                          ///< leaf on leaf: point by point
  Lists from_nodes;                    ///< leaf on the nodes of a smaller cube that it does not touch
  Lists to_nodes;                      ///< a cube's nodes on the points of a larger leaf that does not touch it
  std::vector<FarPair> far;            ///< nodes on nodes of one level, by group, then level, then kind
  std::vector<std::size_t> far_first;  ///< #groups + 1
};

/// Walks both trees from their roots and decides, pair by pair, how one cube's points reach another's.
/// @param few    cubes of no more points than this, which is about a cube's nodes, are summed point by point.
/// @param direct so many pairs of points cost about as much as one far pair.
/// @pre equal roots.
[[nodiscard]] Interactions interactionsOf(const Octree& targets, const Octree& sources, std::size_t few,
                                          std::size_t direct);

}  // namespace spinaltap::rbf
