// core/rbf/fast_sum.h - sum_j w_j |t_i - s_j| for all targets at once, in time linear in sources and targets
// (internal). After: Fong and Darve, "The black-box fast multipole method", J. Comput. Phys. 228 (2009).
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/vec3.h"
#include "core/rbf/chebyshev.h"
#include "core/rbf/far_order.h"
#include "core/rbf/interactions.h"
#include "core/rbf/octree.h"

namespace spinaltap::rbf {

struct FastSumOptions {
  /// Chebyshev nodes an axis of the largest cubes, and one fewer a level: 6 give about 1e-5 of what far points weigh.
  int nodes = 6;
  /// Not empty: instead, each level has as many as keep the sums of these source weights within about `error`.
  std::span<const double> weights;
  double error = 0;
  /// Single precision, three times as fast for near pairs and twice for far ones, is used where it is expected to move
  /// no sum by more; without weights to tell by, for far ones only if this is infinite.
  double single_error = 0;
  std::size_t leaf_size = 120;         ///< a source cube is split while it holds more
  std::size_t target_leaf_size = 120;  ///< and a target cube
  unsigned threads = 0;
};

/// The geometry of one sum: trees, and which cubes see which. Weights come later, as often as wanted. The bits of the
/// result do not depend on the number of threads.
class FastSum {
 public:
  /// Positions may be far from the origin only as far as their digits allow; both sets are copied.
  /// @pre neither set is empty; everything finite.
  FastSum(std::span<const Vec3> sources, std::span<const Vec3> targets, const FastSumOptions& options);

  /// out[i] = sum_j weights[j] |targets[i] - sources[j]|.
  void values(std::span<const double> weights, std::span<double> out) const;
  /// out[i] = sum_j weights[j] (targets[i] - sources[j]) / |targets[i] - sources[j]|, 0 / 0 counting as 0.
  void gradients(std::span<const double> weights, std::span<Vec3> out) const;

  [[nodiscard]] std::size_t bytes() const;

 private:
  static constexpr int kFirstFar = 2;  ///< no cube is far from another above this level

  /// What the cubes of one level are told by: a part with `nodes` for the nearest kinds of pairs, and smaller ones for
  /// those farther apart.
  struct Level {
    int nodes = 0;
    std::vector<std::shared_ptr<const FarOrder>> orders;  ///< of each part
    std::vector<std::size_t> first;                       ///< where each part's values begin, and their whole length
    std::vector<Transfer> narrower;                       ///< from each part to the next
    std::unique_ptr<const Transfer> octants;              ///< from the first part to the parents'
  };
  using Values = std::vector<double>;
  using Offsets = std::vector<std::size_t>;  ///< where each node's values begin

  /// How many nodes an axis each level has, and whether far pairs are in single precision.
  struct Orders {
    std::vector<int> nodes;
    bool single = true;
  };
  [[nodiscard]] Orders chooseOrders(int levels) const;
  void makeLevels(const Orders& orders);
  [[nodiscard]] const Level& levelOf(const OctreeNode& node) const {
    return levels_[static_cast<std::size_t>(node.level)];
  }
  [[nodiscard]] const Chebyshev& chebyshevOf(const OctreeNode& node) const {
    return levelOf(node).orders[0]->chebyshev();
  }
  [[nodiscard]] Offsets offsetsOf(const Octree& tree) const;
  /// use(node index) for the nodes of a level, by all threads.
  template <class Use>
  void eachOf(const Octree& tree, int level, const Use& use) const;

  [[nodiscard]] Values gatherUp(std::span<const double> sorted_weights) const;
  [[nodiscard]] Values passAcross(const Values& up, std::span<const double> sorted_weights) const;
  void farGroup(std::size_t group, const Values& up, Values& down) const;
  template <class T>
  void farColumns(std::size_t from, std::size_t columns, const Values& up, Values& down, std::vector<T>& x,
                  std::vector<T>& y) const;
  void passDown(Values& down) const;
  /// What reaches the target leaves: near points, and nodes of small far cubes.
  template <class Use>
  void eachLeaf(const Values& up, std::span<const double> sorted_weights, const Use& use) const;

  FastSumOptions options_;
  std::shared_ptr<const Octree> sources_, targets_;
  std::vector<Level> levels_;
  Interactions seen_;
  Offsets up_first_, down_first_;
};

}  // namespace spinaltap::rbf
