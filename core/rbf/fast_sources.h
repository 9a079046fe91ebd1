// core/rbf/fast_sources.h - the sources' half of a fast sum (internal): their tree, what its cubes are told by, and
// what weights come to there.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "core/base/parallel.h"
#include "core/base/vec3.h"
#include "core/rbf/chebyshev.h"
#include "core/rbf/far_order.h"
#include "core/rbf/octree.h"

namespace spinaltap::rbf {

struct FastSumOptions {
  /// Chebyshev nodes an axis of the largest cubes, and one fewer a level: 6 give about 1e-5 of what far points weigh.
  int nodes = 6;
  /// Not empty: instead, each level has as many as keep the sums of these source weights within about `error`.
  std::span<const double> weights;
  double error = 0;
  /// Single precision, three times as fast for near pairs and twice for far ones, is used where it is expected to move
  /// sums by no more (root mean square); without weights to tell by, for far ones only if this is infinite.
  double single_error = 0;
  std::size_t leaf_size = 120;         ///< a source cube is split while it holds more
  std::size_t target_leaf_size = 120;  ///< and a target cube
  unsigned threads = 0;
  FarOrders* orders =
      nullptr;  ///< where to find those that another sum made, and leave new ones; used while it is made
};

/// A tree of sources and the orders of its levels; made once, it serves any number of sets of targets.
class FastSources {
 public:
  static constexpr int kFirstFar = 2;  ///< no cube is far from another above this level

  /// What the cubes of one level are told by: their nodes, and behind them the terms of those. Kinds of pairs that are
  /// farther apart use fewer terms.
  struct Level {
    int nodes = 0;
    std::vector<std::shared_ptr<const FarOrder>> orders;  ///< for `nodes`, and for each fewer that some kind needs
    std::size_t terms = 0, length = 0;                    ///< where terms begin, and the whole length
    std::unique_ptr<const Transfer> octants;              ///< to the parents' nodes

    [[nodiscard]] const FarOrder& orderOf(int kind) const {
      return *orders[static_cast<std::size_t>(nodes - nodesFor(kind, nodes))];
    }
  };
  using Values = std::vector<double>;
  using Offsets = std::vector<std::size_t>;  ///< where each node's values begin

  /// @pre not empty, finite, within the root.
  FastSources(std::span<const Vec3> sources, const RootCube& root, const FastSumOptions& options);

  [[nodiscard]] const Octree& tree() const { return tree_; }
  [[nodiscard]] const FastSumOptions& options() const { return options_; }
  [[nodiscard]] const Offsets& first() const { return first_; }
  [[nodiscard]] const std::vector<Level>& levels() const { return levels_; }
  [[nodiscard]] const Level& levelOf(const OctreeNode& node) const {
    return levels_[static_cast<std::size_t>(node.level)];
  }
  [[nodiscard]] const Chebyshev& chebyshevOf(const OctreeNode& node) const {
    return levelOf(node).orders[0]->chebyshev();
  }
  /// Where the values of a tree's nodes begin that has these levels.
  [[nodiscard]] Offsets offsetsOf(const Octree& tree) const;

  /// Weights in the tree's order, and what they come to at every node of every cube that can be far from another.
  struct Weighted {
    std::vector<double> sorted;
    Values up;
  };
  [[nodiscard]] Weighted weigh(std::span<const double> weights) const;

 private:
  /// How many nodes an axis each level has, and whether its far pairs are in single precision.
  struct Orders {
    std::vector<int> nodes;
    std::vector<bool> single;
  };
  [[nodiscard]] std::vector<double> sorted(std::span<const double> weights) const;
  [[nodiscard]] Values gatherUp(std::span<const double> sorted_weights) const;
  [[nodiscard]] Orders chooseOrders() const;
  void makeLevels(const Orders& orders);

  FastSumOptions options_;
  Octree tree_;
  std::vector<Level> levels_;
  Offsets first_;
};

/// use(node index) for the nodes of a level, by all threads.
template <class Use>
void eachOfLevel(const Octree& tree, int level, unsigned threads, const Use& use) {
  const std::size_t first = tree.levelFirst(level);
  parallelBlocks(tree.levelFirst(level + 1) - first, 16, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) use(first + n);
  });
}

/// Which octant of its parent a cube is: bits x, y, z.
[[nodiscard]] inline int octantOf(const OctreeNode& child) {
  return (child.at[0] & 1) | (child.at[1] & 1) << 1 | (child.at[2] & 1) << 2;
}

}  // namespace spinaltap::rbf
