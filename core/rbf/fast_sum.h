// core/rbf/fast_sum.h - sum_j w_j |t_i - s_j| for all targets at once, in time linear in sources and targets
// (internal). After: Fong and Darve, "The black-box fast multipole method", J. Comput. Phys. 228 (2009), with the lists
// of an adaptive tree as in Carrier, Greengard and Rokhlin, SIAM J. Sci. Stat. Comput. 9 (1988).
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/vec3.h"
#include "core/rbf/chebyshev.h"
#include "core/rbf/octree.h"

namespace spinaltap::rbf {

struct FastSumOptions {
  int nodes = 6;                ///< Chebyshev nodes an axis: 4 give about 1e-3 of what far points weigh, 7 about 1e-6
  bool single_near = false;     ///< near pairs in single precision, relative to the target's cube: three times as fast
  std::size_t leaf_size = 120;  ///< a source cube is split while it holds more
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
  struct FarPair {
    std::uint32_t target, source;
    std::uint8_t kind, turn;  ///< which of 16 matrices, seen through which of 48 symmetries of the cube
  };
  /// Per target node a list of source nodes.
  struct Lists {
    std::vector<std::uint32_t> first;  ///< #nodes + 1
    std::vector<std::uint32_t> source;
  };
  class Listing;  ///< builds the lists

  using Values = std::vector<double>;
  [[nodiscard]] Values gatherUp(std::span<const double> sorted_weights) const;
  [[nodiscard]] Values passAcross(const Values& up, std::span<const double> sorted_weights) const;
  void farGroup(std::size_t group, const Values& up, Values& down) const;
  void passDown(Values& down) const;
  /// What reaches the target leaves: near points, and nodes of small far cubes.
  template <class Use>
  void eachLeaf(const Values& up, std::span<const double> sorted_weights, const Use& use) const;

  /// What the cubes of one level are told by.
  struct Order {
    Chebyshev chebyshev;
    std::vector<std::vector<double>> matrices;         ///< 16, stored() x values()
    std::array<std::vector<std::uint16_t>, 48> turns;  ///< node n of a cube is node turns[turn][n] of the turned one
    explicit Order(int nodes);
  };
  /// Where each node's values begin.
  using Offsets = std::vector<std::size_t>;
  void makeOrders();
  [[nodiscard]] const Order& orderOf(int level) const { return *orders_[static_cast<std::size_t>(level)]; }
  [[nodiscard]] Offsets offsetsOf(const Octree& tree) const;

  FastSumOptions options_;
  std::shared_ptr<const Octree> sources_, targets_;
  Lists near_;                          ///< leaf on leaf: point by point
  Lists from_nodes_;                    ///< leaf on the nodes of a smaller cube that it does not touch
  Lists to_nodes_;                      ///< a cube's nodes on the points of a larger leaf that does not touch it
  std::vector<FarPair> far_;            ///< by group, then level, then kind
  std::vector<std::size_t> far_first_;  ///< #groups + 1
  std::vector<std::shared_ptr<const Order>> orders_;        ///< by level
  std::vector<std::shared_ptr<const Transfer>> transfers_;  ///< by the child's level
  Offsets up_first_, down_first_;
};

}  // namespace spinaltap::rbf
