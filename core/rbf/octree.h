// core/rbf/octree.h - points sorted into cubes of cubes (internal).
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/vec3.h"
#include "core/rbf/simd_sums.h"

namespace spinaltap::rbf {

/// The root of an octree; two trees whose cubes lie on the same places have equal roots.
struct RootCube {
  Vec3 middle;
  double half = 1;

  /// The smallest cube around both sets, a hair larger. @pre not both empty.
  [[nodiscard]] static RootCube around(std::span<const Vec3> a, std::span<const Vec3> b = {});
  [[nodiscard]] bool holds(const Vec3& p) const;
};

struct OctreeNode {
  int level = 0;
  std::array<std::int32_t, 3> at{0, 0, 0};  ///< place among the cubes of its level, 0 .. 2^level - 1
  std::uint32_t first = 0, count = 0;       ///< its points in the tree's order
  std::int32_t children = -1;               ///< first child, the others behind it; -1 for a leaf
  std::int32_t child_count = 0;

  [[nodiscard]] bool leaf() const { return children < 0; }
};

/// Cubes are split while they hold more than `leaf_size` points, down to kDeepest levels. Parents come before children,
/// so a loop over nodes goes down the tree and a reverse loop up; those of a level stand together.
class Octree {
 public:
  static constexpr int kDeepest = 20;

  /// @pre the root holds every point. @cost linear in the points and levels.
  Octree(std::span<const Vec3> points, const RootCube& root, std::size_t leaf_size, int deepest = kDeepest);

  [[nodiscard]] const std::vector<OctreeNode>& nodes() const { return nodes_; }
  [[nodiscard]] const RootCube& root() const { return root_; }
  [[nodiscard]] int depth() const { return static_cast<int>(level_first_.size()) - 2; }
  /// The nodes of level n are those from levelFirst(n) to before levelFirst(n + 1). @pre level <= depth() + 1.
  [[nodiscard]] std::size_t levelFirst(int level) const { return level_first_[static_cast<std::size_t>(level)]; }
  /// order()[n] is the index of the tree's n-th point among those given.
  [[nodiscard]] const std::vector<std::uint32_t>& order() const { return order_; }
  /// The n-th points' coordinates relative to the root's middle.
  [[nodiscard]] PointArrays<double> points(const OctreeNode& node) const {
    return {x_.data() + node.first, y_.data() + node.first, z_.data() + node.first, node.count};
  }
  [[nodiscard]] std::size_t size() const { return order_.size(); }
  [[nodiscard]] double halfOf(int level) const { return root_.half / static_cast<double>(std::int64_t{1} << level); }
  /// A node's middle relative to the root's.
  [[nodiscard]] Vec3 middleOf(const OctreeNode& node) const;

 private:
  void split(std::size_t node, const std::vector<std::uint64_t>& keys, std::size_t leaf_size, int deepest);

  RootCube root_;
  std::vector<OctreeNode> nodes_;
  std::vector<std::size_t> level_first_;
  std::vector<std::uint32_t> order_;
  std::vector<double> x_, y_, z_;
};

}  // namespace spinaltap::rbf
