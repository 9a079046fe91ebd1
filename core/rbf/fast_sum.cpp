#include "core/rbf/fast_sum.h"

#include <algorithm>
#include <cmath>

#include "core/base/parallel.h"

namespace spinaltap::rbf {
namespace {

constexpr std::size_t kColumns = 64;      // far pairs multiplied at a time
constexpr int kFewestByRule = 4;          // nodes an axis of the smallest cubes, unless weights say otherwise
constexpr std::size_t kPairOfNodes = 10;  // a near pair of points costs so many products of a far pair

/// Points gathered from several places, relative to a middle.
template <class T>
struct Gathered {
  std::vector<T> x, y, z, w;

  void clear() { x.clear(), y.clear(), z.clear(), w.clear(); }
  void add(const PointArrays<double>& p, const double* weights, const Vec3& middle) {
    for (std::size_t n = 0; n < p.count; ++n) {
      x.push_back(static_cast<T>(p.x[n] - middle.x)), y.push_back(static_cast<T>(p.y[n] - middle.y));
      z.push_back(static_cast<T>(p.z[n] - middle.z));
      if (weights != nullptr) w.push_back(static_cast<T>(weights[n]));
    }
  }
  void addAll(const Gathered<double>& from) {
    for (std::size_t n = 0; n < from.x.size(); ++n) {
      x.push_back(static_cast<T>(from.x[n])), y.push_back(static_cast<T>(from.y[n]));
      z.push_back(static_cast<T>(from.z[n])), w.push_back(static_cast<T>(from.w[n]));
    }
  }
  [[nodiscard]] PointArrays<T> points() const { return {x.data(), y.data(), z.data(), x.size()}; }
};

/// The nodes of a cube as points, relative to the root's middle.
Gathered<double> nodesOf(const Chebyshev& c, const Octree& tree, const OctreeNode& node) {
  Gathered<double> out;
  const Vec3 middle = tree.middleOf(node);
  const double half = tree.halfOf(node.level);
  for (int i = 0; i < c.nodes(); ++i)
    for (int j = 0; j < c.nodes(); ++j)
      for (int k = 0; k < c.nodes(); ++k) {
        out.x.push_back(middle.x + half * c.root(i));
        out.y.push_back(middle.y + half * c.root(j));
        out.z.push_back(middle.z + half * c.root(k));
      }
  return out;
}

int octantOf(const OctreeNode& child) { return (child.at[0] & 1) | (child.at[1] & 1) << 1 | (child.at[2] & 1) << 2; }

std::vector<double> sorted(const Octree& tree, std::span<const double> values) {
  std::vector<double> out(values.size());
  for (std::size_t n = 0; n < out.size(); ++n) out[n] = values[tree.order()[n]];
  return out;
}

/// Of single precision: how far the sum of these points, seen from up to `half` along each axis, may be off. Roundings
/// of the pairs are independent; six of their standard deviations.
double singleError(const Gathered<double>& near, double half) {
  constexpr double kRounding = 6e-8;
  double squares = 0;
  for (std::size_t n = 0; n < near.x.size(); ++n) {
    const double reach = half * 1.75 + std::sqrt(near.x[n] * near.x[n] + near.y[n] * near.y[n] + near.z[n] * near.z[n]);
    squares += near.w[n] * near.w[n] * reach * reach;
  }
  return 6 * kRounding * std::sqrt(squares);
}

}  // namespace

FastSum::FastSum(std::span<const Vec3> sources, std::span<const Vec3> targets, const FastSumOptions& options)
    : options_(options) {
  const RootCube root = RootCube::around(sources, targets);
  sources_ = std::make_shared<const Octree>(sources, root, options.leaf_size);
  const bool same = sources.data() == targets.data() && sources.size() == targets.size();
  // Where no source is near, a target's cube need not be small; deeper than the sources' leaves brings nothing.
  targets_ =
      same ? sources_ : std::make_shared<const Octree>(targets, root, options.target_leaf_size, sources_->depth());
  const Orders orders = chooseOrders(std::max(sources_->depth(), targets_->depth()) + 1);
  const auto last = static_cast<std::size_t>(orders.nodes.back());
  const std::size_t few = last * last * last;
  seen_ = interactionsOf(*targets_, *sources_, few, few * few / kPairOfNodes);
  makeLevels(orders);
  up_first_ = offsetsOf(*sources_), down_first_ = offsetsOf(*targets_);
  options_.weights = {};
}

FastSum::Orders FastSum::chooseOrders(int levels) const {
  Orders out;
  for (int level = 0; level < levels; ++level)
    out.nodes.push_back(
        std::max(std::min(kFewestByRule, options_.nodes), options_.nodes - std::max(0, level - kFirstFar)));
  out.single = std::isinf(options_.single_error);
  if (options_.weights.empty()) return out;
  // A pair of cubes is wrong by farError of half the cube's side and the root of the sum of the weights' squares, since
  // the errors of a cube's points are as often positive as negative; the heaviest cube of each level decides. Three
  // times that for the pairs that a cube is in, and the corners.
  std::vector<double> heaviest(static_cast<std::size_t>(levels), 0.0);
  const std::vector<double> w = sorted(*sources_, options_.weights);
  for (const OctreeNode& node : sources_->nodes()) {
    double squares = 0;
    for (std::size_t n = node.first; n < node.first + node.count; ++n) squares += w[n] * w[n];
    double& most = heaviest[static_cast<std::size_t>(node.level)];
    most = std::max(most, squares);
  }
  double single_error = 0;
  const double share = options_.error / std::sqrt(std::max(1, levels - kFirstFar));
  for (int level = kFirstFar; level < levels; ++level) {
    const auto n = static_cast<std::size_t>(level);
    const double weight = 3 * sources_->halfOf(level) * std::sqrt(heaviest[n]);
    out.nodes[n] = Chebyshev::kFewest;
    while (out.nodes[n] < Chebyshev::kMost && farError(out.nodes[n]) * weight > share) ++out.nodes[n];
    single_error = std::hypot(single_error, kFarSingleError * weight);
  }
  out.single = single_error <= options_.single_error;
  return out;
}

void FastSum::makeLevels(const Orders& chosen) {
  const std::vector<int>& nodes = chosen.nodes;
  std::array<std::shared_ptr<FarOrder>, Chebyshev::kMost + 1> orders;
  const auto orderOf = [&](int n) -> const std::shared_ptr<FarOrder>& {
    std::shared_ptr<FarOrder>& order = orders[static_cast<std::size_t>(n)];
    if (order == nullptr) order = std::make_shared<FarOrder>(n, chosen.single);
    return order;
  };
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    Level& level = levels_.emplace_back();
    level.nodes = nodes[n], level.first = {0};
    for (int part = nodes[n]; part >= nodesFor(FarKind::kCount - 1, nodes[n]); --part) {
      level.orders.push_back(orderOf(part));
      level.first.push_back(level.first.back() + orderOf(part)->chebyshev().stored());
      if (part < nodes[n])
        level.narrower.push_back(Transfer::within(orderOf(part)->chebyshev(), orderOf(part + 1)->chebyshev()));
    }
    if (n > 0)
      level.octants = std::make_unique<const Transfer>(
          Transfer::toOctants(orderOf(nodes[n - 1])->chebyshev(), orderOf(nodes[n])->chebyshev()));
  }
  for (const Interactions::FarPair& pair : seen_.far) {
    const int n = nodes[static_cast<std::size_t>(targets_->nodes()[pair.target].level)];
    orderOf(nodesFor(pair.kind.kind, n))->prepare(pair.kind.kind);
  }
}

FastSum::Offsets FastSum::offsetsOf(const Octree& tree) const {
  Offsets out{0};
  for (const OctreeNode& node : tree.nodes()) out.push_back(out.back() + levelOf(node).first.back());
  return out;
}

std::size_t FastSum::bytes() const {
  return seen_.far.size() * sizeof(Interactions::FarPair) +
         (seen_.near.source.size() + seen_.from_nodes.source.size()) * sizeof(std::uint32_t) +
         (sources_->size() + targets_->size()) * 28 + (up_first_.back() + down_first_.back()) * sizeof(double);
}

template <class Use>
void FastSum::eachOf(const Octree& tree, int level, const Use& use) const {
  const std::size_t first = tree.levelFirst(level);
  parallelBlocks(tree.levelFirst(level + 1) - first, 16, options_.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) use(first + n);
  });
}

FastSum::Values FastSum::gatherUp(std::span<const double> weights) const {
  const Octree& tree = *sources_;
  Values up(up_first_.back(), 0.0);
  for (int at = tree.depth(); at >= kFirstFar; --at) {
    const Level& level = levels_[static_cast<std::size_t>(at)];
    eachOf(tree, at, [&](std::size_t n) {
      const OctreeNode& node = tree.nodes()[n];
      double* const own = up.data() + up_first_[n];
      if (node.leaf()) {
        const Vec3 m = tree.middleOf(node);
        const double middle[3] = {m.x, m.y, m.z};
        chebyshevOf(node).gather(tree.points(node), weights.data() + node.first, middle, tree.halfOf(at), own);
      }
      for (std::int32_t c = 0; c < node.child_count; ++c) {
        const std::size_t child = static_cast<std::size_t>(node.children + c);
        const OctreeNode& from = tree.nodes()[child];
        levelOf(from).octants->toCoarse(octantOf(from), up.data() + up_first_[child], own);
      }
      for (std::size_t part = 0; part < level.narrower.size(); ++part)
        level.narrower[part].toCoarse(0, own + level.first[part], own + level.first[part + 1]);
    });
  }
  return up;
}

template <class T>
void FastSum::farColumns(std::size_t from, std::size_t columns, const Values& up, Values& down, std::vector<T>& x,
                         std::vector<T>& y) const {
  const OctreeNode& first = targets_->nodes()[seen_.far[from].target];
  const Level& level = levelOf(first);
  const int kind = seen_.far[from].kind.kind;
  const auto part = static_cast<std::size_t>(level.nodes - nodesFor(kind, level.nodes));
  const FarOrder& order = *level.orders[part];
  const std::size_t stored = order.chebyshev().stored(), count = order.chebyshev().values();
  const double scale = sources_->halfOf(first.level);
  const std::vector<double>& along = order.along(kind);
  x.resize(count * kColumns), y.resize(stored * kColumns);
  std::array<double, kColumns> sum, reach;  // of the weights, and of weights times how far their nodes are
  for (std::size_t c = 0; c < columns; ++c) {
    const Interactions::FarPair& pair = seen_.far[from + c];
    const double* const source = up.data() + up_first_[pair.source] + level.first[part];
    const std::vector<std::uint16_t>& turned = order.turned(pair.kind.turn);
    T* const to = x.data() + c * count;
    double weights = 0, moment = 0;
    for (std::size_t n = 0; n < count; ++n) {
      const double w = scale * source[n];
      to[turned[n]] = static_cast<T>(w);
      weights += w, moment += w * along[turned[n]];
    }
    sum[c] = weights, reach[c] = moment + weights * order.distance(kind);
  }
  order.see(kind, x.data(), columns, y.data());
  for (std::size_t c = 0; c < columns; ++c) {
    const Interactions::FarPair& pair = seen_.far[from + c];
    double* const target = down.data() + down_first_[pair.target] + level.first[part];
    const std::vector<std::uint16_t>& turned = order.turned(pair.kind.turn);
    const T* const result = y.data() + c * stored;
    for (std::size_t n = 0; n < count; ++n)
      target[n] += static_cast<double>(result[turned[n]]) + (reach[c] - sum[c] * along[turned[n]]);
  }
}

void FastSum::farGroup(std::size_t group, const Values& up, Values& down) const {
  std::vector<double> x, y;
  std::vector<float> single_x, single_y;
  const std::vector<OctreeNode>& nodes = targets_->nodes();
  const std::size_t end = seen_.far_first[group + 1];
  for (std::size_t from = seen_.far_first[group]; from < end;) {
    const int kind = seen_.far[from].kind.kind, level = nodes[seen_.far[from].target].level;
    std::size_t columns = 1;
    while (columns < kColumns && from + columns < end && seen_.far[from + columns].kind.kind == kind &&
           nodes[seen_.far[from + columns].target].level == level)
      ++columns;
    const Level& own = levels_[static_cast<std::size_t>(level)];
    if (own.orders[static_cast<std::size_t>(own.nodes - nodesFor(kind, own.nodes))]->single()) {
      farColumns(from, columns, up, down, single_x, single_y);
    } else {
      farColumns(from, columns, up, down, x, y);
    }
    from += columns;
  }
}

FastSum::Values FastSum::passAcross(const Values& up, std::span<const double> weights) const {
  const std::vector<OctreeNode>& nodes = targets_->nodes();
  const Interactions::Lists& lists = seen_.to_nodes;
  Values down(down_first_.back(), 0.0);
  parallelBlocks(seen_.far_first.size() - 1, 1, options_.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t group = begin; group < end; ++group) farGroup(group, up, down);
  });
  parallelBlocks(nodes.size(), 16, options_.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      if (lists.first[n] == lists.first[n + 1]) continue;
      const Gathered<double> at = nodesOf(chebyshevOf(nodes[n]), *targets_, nodes[n]);
      for (std::uint32_t i = lists.first[n]; i < lists.first[n + 1]; ++i) {
        const OctreeNode& source = sources_->nodes()[lists.source[i]];
        addDistances(at.points(), sources_->points(source), weights.data() + source.first,
                     down.data() + down_first_[n]);
      }
    }
  });
  return down;
}

void FastSum::passDown(Values& down) const {
  const Octree& tree = *targets_;
  for (int at = kFirstFar; at <= tree.depth(); ++at) {
    const Level& level = levels_[static_cast<std::size_t>(at)];
    eachOf(tree, at, [&](std::size_t n) {
      double* const own = down.data() + down_first_[n];
      for (std::size_t part = level.narrower.size(); part-- > 0;)
        level.narrower[part].toFine(0, own + level.first[part + 1], own + level.first[part]);
      const OctreeNode& node = tree.nodes()[n];
      for (std::int32_t c = 0; c < node.child_count; ++c) {
        const std::size_t child = static_cast<std::size_t>(node.children + c);
        const OctreeNode& to = tree.nodes()[child];
        levelOf(to).octants->toFine(octantOf(to), own, down.data() + down_first_[child]);
      }
    });
  }
}

template <class Use>
void FastSum::eachLeaf(const Values& up, std::span<const double> weights, const Use& use) const {
  const std::vector<OctreeNode>& nodes = targets_->nodes();
  const Interactions::Lists &near = seen_.near, &from_nodes = seen_.from_nodes;
  parallelBlocks(nodes.size(), 8, options_.threads, [&](std::size_t begin, std::size_t end) {
    Gathered<double> wide;
    Gathered<float> narrow;
    for (std::size_t n = begin; n < end; ++n) {
      const OctreeNode& node = nodes[n];
      if (!node.leaf() || node.count == 0) continue;
      const Vec3 middle = targets_->middleOf(node);
      wide.clear(), narrow.clear();
      for (std::uint32_t i = near.first[n]; i < near.first[n + 1]; ++i) {
        const OctreeNode& source = sources_->nodes()[near.source[i]];
        wide.add(sources_->points(source), weights.data() + source.first, middle);
      }
      for (std::uint32_t i = from_nodes.first[n]; i < from_nodes.first[n + 1]; ++i) {
        const std::size_t source = from_nodes.source[i];
        const OctreeNode& cube = sources_->nodes()[source];
        const Gathered<double> at = nodesOf(chebyshevOf(cube), *sources_, cube);
        wide.add(at.points(), up.data() + up_first_[source], middle);
      }
      if (options_.single_error > 0 && singleError(wide, targets_->halfOf(node.level)) <= options_.single_error) {
        narrow.addAll(wide);
        wide.clear();
      }
      use(n, middle, wide, narrow);
    }
  });
}

void FastSum::values(std::span<const double> weights, std::span<double> out) const {
  const std::vector<double> w = sorted(*sources_, weights);
  const Values up = gatherUp(w);
  Values down = passAcross(up, w);
  passDown(down);
  std::vector<double> sums(targets_->size(), 0.0);
  eachLeaf(up, w, [&](std::size_t n, const Vec3& m, const Gathered<double>& wide, const Gathered<float>& narrow) {
    const OctreeNode& node = targets_->nodes()[n];
    const PointArrays<double> points = targets_->points(node);
    double* const to = sums.data() + node.first;
    const double middle[3] = {m.x, m.y, m.z};
    if (node.level >= kFirstFar)
      chebyshevOf(node).spread(down.data() + down_first_[n], middle, targets_->halfOf(node.level), points, to);
    Gathered<double> own;
    own.add(points, nullptr, m);
    if (!wide.x.empty()) addDistances(own.points(), wide.points(), wide.w.data(), to);
    if (!narrow.x.empty()) {
      Gathered<float> single;
      single.add(points, nullptr, m);
      addDistances(single.points(), narrow.points(), narrow.w.data(), to);
    }
  });
  for (std::size_t n = 0; n < sums.size(); ++n) out[targets_->order()[n]] = sums[n];
}

void FastSum::gradients(std::span<const double> weights, std::span<Vec3> out) const {
  const std::vector<double> w = sorted(*sources_, weights);
  const Values up = gatherUp(w);
  Values down = passAcross(up, w);
  passDown(down);
  std::vector<double> x(targets_->size(), 0.0), y = x, z = x;
  eachLeaf(up, w, [&](std::size_t n, const Vec3& m, const Gathered<double>& wide, const Gathered<float>& narrow) {
    const OctreeNode& node = targets_->nodes()[n];
    const PointArrays<double> points = targets_->points(node);
    const std::size_t at = node.first;
    const double middle[3] = {m.x, m.y, m.z};
    if (node.level >= kFirstFar)
      chebyshevOf(node).spreadGradient(down.data() + down_first_[n], middle, targets_->halfOf(node.level), points,
                                       x.data() + at, y.data() + at, z.data() + at);
    Gathered<double> own;
    own.add(points, nullptr, m);
    if (!wide.x.empty())
      addDirections(own.points(), wide.points(), wide.w.data(), x.data() + at, y.data() + at, z.data() + at);
    if (!narrow.x.empty()) {
      Gathered<float> single;
      single.add(points, nullptr, m);
      addDirections(single.points(), narrow.points(), narrow.w.data(), x.data() + at, y.data() + at, z.data() + at);
    }
  });
  for (std::size_t n = 0; n < x.size(); ++n) out[targets_->order()[n]] = {x[n], y[n], z[n]};
}

}  // namespace spinaltap::rbf
