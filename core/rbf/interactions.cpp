#include "core/rbf/interactions.h"

#include <algorithm>
#include <cstdlib>

namespace spinaltap::rbf {
namespace {

class Listing {
 public:
  Listing(const Octree& targets, const Octree& sources, std::size_t few, std::size_t direct)
      : targets_(targets.nodes()), sources_(sources.nodes()), few_(few), direct_(direct) {}

  [[nodiscard]] Interactions make() {
    equal(0, 0);
    out_.near = listsOf(near_), out_.from_nodes = listsOf(from_nodes_), out_.to_nodes = listsOf(to_nodes_);
    groupFar();
    return std::move(out_);
  }

 private:
  using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

  /// Two cubes of one level.
  void equal(std::uint32_t t, std::uint32_t s) {
    const OctreeNode &target = targets_[t], &source = sources_[s];
    std::array<int, 3> offset{};
    bool apart = false;
    for (std::size_t n = 0; n < 3; ++n) {
      offset[n] = source.at[n] - target.at[n];
      apart = apart || std::abs(offset[n]) > 1;
    }
    if (apart) {
      const std::size_t pairs = std::size_t{target.count} * source.count;
      if (target.leaf() && source.leaf() && pairs < direct_) {
        near_.emplace_back(t, s);
      } else {
        out_.far.push_back({t, s, farKindOf(offset)});
      }
    } else if (target.leaf() && source.leaf()) {
      near_.emplace_back(t, s);
    } else if (target.leaf()) {
      eachChild(source, [&](std::uint32_t c) { smallerSource(t, c); });
    } else if (source.leaf()) {
      eachChild(target, [&](std::uint32_t c) { smallerTarget(c, s); });
    } else {
      eachChild(target, [&](std::uint32_t ct) { eachChild(source, [&](std::uint32_t cs) { equal(ct, cs); }); });
    }
  }

  void smallerSource(std::uint32_t t, std::uint32_t s) {
    const OctreeNode& source = sources_[s];
    if (touch(targets_[t], source)) {
      if (source.leaf()) {
        near_.emplace_back(t, s);
      } else {
        eachChild(source, [&](std::uint32_t c) { smallerSource(t, c); });
      }
    } else if (source.count <= few_) {
      allLeaves(source, s, [&](std::uint32_t leaf) { near_.emplace_back(t, leaf); }, sources_);
    } else {
      from_nodes_.emplace_back(t, s);
    }
  }

  void smallerTarget(std::uint32_t t, std::uint32_t s) {
    const OctreeNode& target = targets_[t];
    if (touch(sources_[s], target)) {
      if (target.leaf()) {
        near_.emplace_back(t, s);
      } else {
        eachChild(target, [&](std::uint32_t c) { smallerTarget(c, s); });
      }
    } else if (target.count <= few_) {
      allLeaves(target, t, [&](std::uint32_t leaf) { near_.emplace_back(leaf, s); }, targets_);
    } else {
      to_nodes_.emplace_back(t, s);
    }
  }

  template <class Use>
  static void eachChild(const OctreeNode& node, const Use& use) {
    for (std::int32_t n = 0; n < node.child_count; ++n) use(static_cast<std::uint32_t>(node.children + n));
  }

  template <class Use>
  void allLeaves(const OctreeNode& node, std::uint32_t index, const Use& use, const std::vector<OctreeNode>& nodes) {
    if (node.leaf()) return use(index);
    eachChild(node, [&](std::uint32_t c) { allLeaves(nodes[c], c, use, nodes); });
  }

  /// Whether a smaller cube touches a larger one.
  static bool touch(const OctreeNode& large, const OctreeNode& small) {
    const int levels = small.level - large.level;
    for (std::size_t n = 0; n < 3; ++n) {
      const std::int64_t low = std::int64_t{large.at[n]} << levels, high = (std::int64_t{large.at[n]} + 1) << levels;
      if (small.at[n] + 1 < low || small.at[n] > high) return false;
    }
    return true;
  }

  [[nodiscard]] Interactions::Lists listsOf(Pairs& pairs) const {
    std::stable_sort(pairs.begin(), pairs.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    Interactions::Lists out;
    out.first.assign(targets_.size() + 1, 0);
    for (const auto& [t, s] : pairs) {
      ++out.first[t + 1];
      out.source.push_back(s);
    }
    for (std::size_t n = 1; n < out.first.size(); ++n) out.first[n] += out.first[n - 1];
    return out;
  }

  void groupFar() {
    const auto group = [](const Interactions::FarPair& f) { return f.target / Interactions::kGroup; };
    std::stable_sort(out_.far.begin(), out_.far.end(),
                     [&](const Interactions::FarPair& a, const Interactions::FarPair& b) {
                       if (group(a) != group(b)) return group(a) < group(b);
                       const int level_a = targets_[a.target].level, level_b = targets_[b.target].level;
                       return level_a != level_b ? level_a < level_b : a.kind.kind < b.kind.kind;
                     });
    out_.far_first.assign(targets_.size() / Interactions::kGroup + 2, 0);
    for (const Interactions::FarPair& f : out_.far) ++out_.far_first[group(f) + 1];
    for (std::size_t n = 1; n < out_.far_first.size(); ++n) out_.far_first[n] += out_.far_first[n - 1];
  }

  const std::vector<OctreeNode>&targets_, &sources_;
  std::size_t few_, direct_;
  Pairs near_, from_nodes_, to_nodes_;
  Interactions out_;
};

}  // namespace

Interactions interactionsOf(const Octree& targets, const Octree& sources, std::size_t few, std::size_t direct) {
  return Listing(targets, sources, few, direct).make();
}

}  // namespace spinaltap::rbf
