#include "core/rbf/fast_sources.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace spinaltap::rbf {
namespace {
constexpr int kFewestByRule = 4;  // nodes an axis of the smallest cubes, unless weights say otherwise
}  // namespace

FastSources::FastSources(std::span<const Vec3> sources, const RootCube& root, const FastSumOptions& options)
    : options_(options), tree_(sources, root, options.leaf_size) {
  makeLevels(chooseOrders());
  options_.weights = {}, options_.orders = nullptr;
  first_ = offsetsOf(tree_);
}

std::vector<double> FastSources::sorted(std::span<const double> weights) const {
  std::vector<double> out(weights.size());
  for (std::size_t n = 0; n < out.size(); ++n) out[n] = weights[tree_.order()[n]];
  return out;
}

FastSources::Orders FastSources::chooseOrders() const {
  const int levels = tree_.depth() + 1;
  Orders out;
  for (int level = 0; level < levels; ++level)
    out.nodes.push_back(
        std::max(std::min(kFewestByRule, options_.nodes), options_.nodes - std::max(0, level - kFirstFar)));
  out.single.assign(out.nodes.size(), std::isinf(options_.single_error));
  if (options_.weights.empty()) return out;
  // A pair of cubes is wrong by farError of half the cube's side and the root of the sum of the weights' squares, since
  // the errors of a cube's points are as often positive as negative; the heaviest cube of each level decides. Three
  // times that for the pairs that a cube is in, and the corners.
  std::vector<double> heaviest(static_cast<std::size_t>(levels), 0.0);
  const std::vector<double> w = sorted(options_.weights);
  for (const OctreeNode& node : tree_.nodes()) {
    double squares = 0;
    for (std::size_t n = node.first; n < node.first + node.count; ++n) squares += w[n] * w[n];
    double& most = heaviest[static_cast<std::size_t>(node.level)];
    most = std::max(most, squares);
  }
  double single_error = 0;  // of the levels that are
  const double share = options_.error / std::sqrt(std::max(1, levels - kFirstFar));
  for (int level = levels - 1; level >= kFirstFar; --level) {
    const auto n = static_cast<std::size_t>(level);
    const double weight = 3 * tree_.halfOf(level) * std::sqrt(heaviest[n]);
    out.nodes[n] = Chebyshev::kFewest;
    while (out.nodes[n] < Chebyshev::kMost && farError(out.nodes[n]) * weight > share) ++out.nodes[n];
    const double with_it = std::hypot(single_error, kFarSingleError * weight);
    out.single[n] = with_it <= options_.single_error;
    if (out.single[n]) single_error = with_it;
  }
  return out;
}

void FastSources::makeLevels(const Orders& chosen) {
  const std::vector<int>& nodes = chosen.nodes;
  FarOrders own;
  FarOrders& orders = options_.orders != nullptr ? *options_.orders : own;
  const auto orderOf = [&](int count, std::size_t level) -> const std::shared_ptr<FarOrder>& {
    return orders.get(count, chosen.single[level]);
  };
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    Level& level = levels_.emplace_back();
    level.nodes = nodes[n];
    for (int count = nodes[n]; count >= nodesFor(FarKind::kCount - 1, nodes[n]); --count)
      level.orders.push_back(orderOf(count, n));
    level.terms = level.orders[0]->chebyshev().stored(), level.length = level.terms + level.orders[0]->stored();
    if (n > 0)
      level.octants = std::make_unique<const Transfer>(
          Transfer::toOctants(orderOf(nodes[n - 1], n - 1)->chebyshev(), orderOf(nodes[n], n)->chebyshev()));
  }
  std::vector<std::pair<FarOrder*, int>> wanted;
  for (std::size_t n = kFirstFar; n < nodes.size(); ++n)
    for (int kind = 0; kind < FarKind::kCount; ++kind)
      wanted.emplace_back(orderOf(nodesFor(kind, nodes[n]), n).get(), kind);
  std::sort(wanted.begin(), wanted.end());
  wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
  parallelBlocks(wanted.size(), 1, options_.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) wanted[n].first->prepare(wanted[n].second);
  });
}

FastSources::Offsets FastSources::offsetsOf(const Octree& tree) const {
  Offsets out{0};
  for (const OctreeNode& node : tree.nodes()) out.push_back(out.back() + levelOf(node).length);
  return out;
}

FastSources::Weighted FastSources::weigh(std::span<const double> weights) const {
  Weighted out{sorted(weights), {}};
  out.up = gatherUp(out.sorted);
  return out;
}

FastSources::Values FastSources::gatherUp(std::span<const double> weights) const {
  const Octree& tree = tree_;
  Values up(first_.back(), 0.0);
  for (int at = tree.depth(); at >= kFirstFar; --at) {
    const Level& level = levels_[static_cast<std::size_t>(at)];
    eachOfLevel(tree, at, options_.threads, [&](std::size_t n) {
      const OctreeNode& node = tree.nodes()[n];
      double* const own = up.data() + first_[n];
      if (node.leaf()) {
        const Vec3 m = tree.middleOf(node);
        const double middle[3] = {m.x, m.y, m.z};
        chebyshevOf(node).gather(tree.points(node), weights.data() + node.first, middle, tree.halfOf(at), own);
      }
      for (std::int32_t c = 0; c < node.child_count; ++c) {
        const std::size_t child = static_cast<std::size_t>(node.children + c);
        const OctreeNode& from = tree.nodes()[child];
        levelOf(from).octants->toCoarse(octantOf(from), up.data() + first_[child], own);
      }
      chebyshevOf(node).weighTerms(own, own + level.terms);
    });
  }
  return up;
}

}  // namespace spinaltap::rbf
